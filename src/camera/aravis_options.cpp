
#include "camera/aravis_camera.hpp"
#include "camera/aravis_formats.hpp"
#include "camera/bad_input.hpp"
#include "camera/live_source.hpp"
#include "camera/source_keys.hpp"

namespace berth {
namespace {

constexpr const char* kKeys =
    "width, height, x, y, fps, format, exposure_us, gain, trigger, packet_size, buffers, retention_ms, resend, "
    "packet_socket, time, timestamp, watchdog_ms, repeats";

bool set_image(AravisOptions& options, const SourceKeys& keys, const std::string& key, const std::string& value) {
  if (key == "width") {
    options.width = keys.whole(key, value, 1, 16384);
  } else if (key == "height") {
    options.height = keys.whole(key, value, 1, 16384);
  } else if (key == "x") {
    options.x = keys.whole(key, value, 0, 65535);
  } else if (key == "y") {
    options.y = keys.whole(key, value, 0, 65535);
  } else if (key == "format") {
    options.format = keys.one_of(key, value, aravis_formats());
  } else {
    return false;
  }
  return true;
}

bool set_capture(AravisOptions& options, const SourceKeys& keys, const std::string& key, const std::string& value) {
  if (key == "fps") {
    options.fps = keys.frames_per_second(key, value);
  } else if (key == "exposure_us") {
    options.exposure_us = keys.whole(key, value, 1, 10'000'000);
  } else if (key == "gain") {
    options.gain = keys.real(key, value, 0, 1e6);
  } else if (key == "trigger") {
    if (value.empty() || value == "Software") {
      keys.refuse(key, value, "name an input of the camera, e.g. Line1; without the key it goes by its own clock");
    }
    options.trigger = value;
  } else {
    return false;
  }
  return true;
}

bool set_transport(AravisOptions& options, const SourceKeys& keys, const std::string& key, const std::string& value) {
  if (key == "packet_size") {
    options.packet_size = keys.whole(key, value, 576, 16384);
  } else if (key == "buffers") {
    options.buffers = keys.whole(key, value, 2, 64);
  } else if (key == "retention_ms") {
    options.retention_ms = keys.real(key, value, 0.1, 1000);
  } else if (key == "resend") {
    options.resend = keys.on_or_off(key, value);
  } else if (key == "packet_socket") {
    options.packet_socket = keys.on_or_off(key, value);
  } else if (key == "time") {
    if (value != "host" && value != "camera" && value != "ptp") keys.refuse(key, value, "give host, camera or ptp");
    options.time = value == "host"     ? AravisOptions::Time::host
                   : value == "camera" ? AravisOptions::Time::camera
                                       : AravisOptions::Time::ptp;
  } else if (key == "timestamp") {
    if (value != "leader" && value != "chunk") keys.refuse(key, value, "give leader or chunk");
    options.chunk_time = value == "chunk";
  } else if (key == "watchdog_ms") {
    options.watchdog_ms = keys.whole(key, value, 1, 60'000);
  } else if (key == "repeats") {
    options.repeats = keys.on_or_off(key, value);
  } else {
    return false;
  }
  return true;
}

}  // namespace

AravisOptions parse_aravis(const std::string& text) {
  const SourceKeys keys("aravis", kKeys);
  AravisOptions options;
  options.name = keys.read(text, [&](const std::string& key, const std::string& value) {
    return set_image(options, keys, key, value) || set_capture(options, keys, key, value) ||
           set_transport(options, keys, key, value);
  });
  if (options.name.empty()) {
    throw bad_field("--source", "aravis:", "''", "name a camera by its serial number; berth doctor lists them");
  }
  keys.check_size(options.width, options.height);
  if ((options.x > 0 || options.y > 0) && options.width == 0) {
    throw bad_field("--source", options.x > 0 ? "aravis:…,x" : "aravis:…,y", "given alone",
                    "give width and height, too");
  }
  if (!options.trigger.empty() && options.fps > 0) {
    throw bad_field("--source", "aravis:…,fps", "given beside trigger",
                    "leave one of the two out: whoever triggers sets the rate");
  }
  if (options.chunk_time && options.time == AravisOptions::Time::host) {
    throw bad_field("--source", "aravis:…,timestamp", "'chunk'",
                    "give time=camera or time=ptp, too: the host's time is that of a frame's first packet");
  }
  return options;
}

std::vector<std::string> aravis_formats() {
  std::vector<std::string> names;
  for (const AravisFormat& format : kAravisFormats) names.emplace_back(format.name);
  return names;
}

std::unique_ptr<CameraSource> open_aravis(const AravisOptions& options) {
  LiveOptions live = live_options("aravis:" + options.name, options);
  live.closes_aside = true;
  return open_live(live, aravis_opener(options));
}

#ifndef BERTH_WITH_ARAVIS
LiveCameraOpener aravis_opener(const AravisOptions& options) {
  throw Error("aravis:" + options.name +
              ": this berth was built without Aravis; install libaravis-dev and libusb-1.0-0-dev, and build again with "
              "-DBERTH_WITH_ARAVIS=ON");
}

std::vector<std::string> list_aravis_cameras() { return {}; }
#endif

}  // namespace berth
