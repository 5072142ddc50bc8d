#include <algorithm>
#include <cctype>

#include "camera/bad_input.hpp"
#include "camera/gst_camera.hpp"
#include "camera/gst_formats.hpp"
#include "camera/live_source.hpp"
#include "camera/source_keys.hpp"

namespace berth {
namespace {

bool set(GstOptions& options, const SourceKeys& keys, const std::string& key, const std::string& value) {
  if (key == "exposure_us") {
    options.exposure_us = keys.whole(key, value, 1, 10'000'000);
  } else if (key == "buffers") {
    options.buffers = keys.whole(key, value, 2, 64);
  } else if (key == "watchdog_ms") {
    options.watchdog_ms = keys.whole(key, value, 1, 60'000);
  } else if (key == "repeats") {
    options.repeats = keys.on_or_off(key, value);
  } else {
    return false;
  }
  return true;
}

/// A pipeline begins with an element, and no element's name has a '=' behind it.
bool begins_with_a_key(const std::string& text) {
  const auto end =
      std::find_if(text.begin(), text.end(), [](unsigned char c) { return std::islower(c) == 0 && c != '_'; });
  return end != text.begin() && end != text.end() && *end == '=';
}

}  // namespace

GstOptions parse_gst(const std::string& text) {
  const SourceKeys keys("gst", "exposure_us, buffers, watchdog_ms, repeats");
  GstOptions options;
  std::string rest = text;
  if (begins_with_a_key(text)) {
    const std::size_t end = text.find(';');
    if (end == std::string::npos) {
      throw bad_field("--source", "gst:", "'" + text + "'",
                      "give the pipeline behind the keys and a ';', as in gst:exposure_us=2000;v4l2src ! videoconvert");
    }
    keys.read("," + text.substr(0, end),
              [&](const std::string& key, const std::string& value) { return set(options, keys, key, value); });
    rest = text.substr(end + 1);
  }
  const std::size_t first = rest.find_first_not_of(' ');
  if (first == std::string::npos) {
    throw bad_field("--source", "gst:", "''",
                    "give a pipeline without its sink, as gst-launch-1.0 takes it, e.g. gst:v4l2src ! videoconvert");
  }
  options.pipeline = rest.substr(first);
  return options;
}

std::string name_of(const GstOptions& options) {
  return "gst:" + options.pipeline.substr(0, options.pipeline.find_first_of(" !"));
}

std::vector<std::string> gst_formats() {
  std::vector<std::string> names;
  for (const GstFormat& format : kGstFormats) names.emplace_back(format.name);
  return names;
}

std::unique_ptr<CameraSource> open_gst(const GstOptions& options) {
  LiveOptions live = live_options(name_of(options), options);
  live.closes_aside = true;
  return open_live(live, gst_opener(options));
}

#ifndef BERTH_WITH_GSTREAMER
LiveCameraOpener gst_opener(const GstOptions& options) {
  throw Error(name_of(options) +
              ": this berth was built without GStreamer; install libgstreamer1.0-dev and "
              "libgstreamer-plugins-base1.0-dev, and build again with -DBERTH_WITH_GSTREAMER=ON");
}
#endif

}  // namespace berth
