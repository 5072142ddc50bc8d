#include <limits>

#include "camera/bad_input.hpp"
#include "camera/source_keys.hpp"
#include "camera/v4l2_camera.hpp"

namespace berth {
namespace {

std::string device_path(const std::string& name) {
  if (name.empty()) throw bad_field("--source", "v4l2:", "''", "name a camera, e.g. v4l2:/dev/video0");
  if (name[0] == '/') return name;
  const bool stable = name.rfind("by-path/", 0) == 0 || name.rfind("by-id/", 0) == 0;
  return (stable ? "/dev/v4l/" : "/dev/") + name;
}

bool set(V4l2Options& options, const SourceKeys& keys, const std::string& key, const std::string& value) {
  constexpr int kMost = std::numeric_limits<int>::max();
  if (key == "width") {
    options.width = keys.whole(key, value, 1, 16384);
  } else if (key == "height") {
    options.height = keys.whole(key, value, 1, 16384);
  } else if (key == "fps") {
    options.fps = keys.frames_per_second(key, value);
  } else if (key == "format") {
    options.format = keys.one_of(key, value, v4l2_formats());
  } else if (key == "exposure_us") {
    options.exposure_us = keys.whole(key, value, 1, 10'000'000);
  } else if (key == "gain") {
    options.gain = keys.whole(key, value, 0, kMost);
  } else if (key == "buffers") {
    options.buffers = keys.whole(key, value, 2, 32);
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

V4l2Options parse_v4l2(const std::string& text) {
  const SourceKeys keys("v4l2", "width, height, fps, format, exposure_us, gain, buffers, watchdog_ms, repeats");
  V4l2Options options;
  options.path = device_path(keys.read(
      text, [&](const std::string& key, const std::string& value) { return set(options, keys, key, value); }));
  keys.check_size(options.width, options.height);
  return options;
}

}  // namespace berth
