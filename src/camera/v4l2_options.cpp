#include <algorithm>
#include <charconv>
#include <limits>
#include <locale>
#include <sstream>

#include "camera/bad_input.hpp"
#include "camera/v4l2_camera.hpp"

namespace berth {
namespace {

constexpr const char* kSource = "--source";
constexpr const char* kKeys = "width, height, fps, format, exposure_us, gain, buffers, watchdog_ms";

[[noreturn]] void refuse(const std::string& key, const std::string& value, const std::string& remedy) {
  throw bad_field(kSource, "v4l2:…," + key, "'" + value + "'", remedy);
}

int whole(const std::string& key, const std::string& value, int least, int most) {
  int number = 0;
  const char* end = value.data() + value.size();
  const auto parsed = std::from_chars(value.data(), end, number);
  if (parsed.ec != std::errc() || parsed.ptr != end || number < least || number > most) {
    refuse(key, value, "give a whole number from " + std::to_string(least) + " to " + std::to_string(most));
  }
  return number;
}

double frames_per_second(const std::string& value) {
  std::istringstream stream(value);
  stream.imbue(std::locale::classic());
  double fps = 0;
  stream >> fps;
  if (stream.fail() || !stream.eof() || !(fps > 0) || !(fps <= 10000)) {
    refuse("fps", value, "give frames per second, above 0 and at most 10000");
  }
  return fps;
}

std::string device_path(const std::string& name) {
  if (name.empty()) throw bad_field(kSource, "v4l2:", "''", "name a camera, e.g. v4l2:/dev/video0");
  if (name[0] == '/') return name;
  const bool stable = name.rfind("by-path/", 0) == 0 || name.rfind("by-id/", 0) == 0;
  return (stable ? "/dev/v4l/" : "/dev/") + name;
}

void set(V4l2Options& options, const std::string& key, const std::string& value) {
  constexpr int kMost = std::numeric_limits<int>::max();
  if (key == "width") {
    options.width = whole(key, value, 1, 16384);
  } else if (key == "height") {
    options.height = whole(key, value, 1, 16384);
  } else if (key == "fps") {
    options.fps = frames_per_second(value);
  } else if (key == "format") {
    const std::vector<std::string> known = v4l2_formats();
    if (std::find(known.begin(), known.end(), value) == known.end()) {
      std::string all;
      for (const std::string& format : known) all += (all.empty() ? "" : ", ") + format;
      refuse(key, value, "give one of " + all);
    }
    options.format = value;
  } else if (key == "exposure_us") {
    options.exposure_us = whole(key, value, 1, 10'000'000);
  } else if (key == "gain") {
    options.gain = whole(key, value, 0, kMost);
  } else if (key == "buffers") {
    options.buffers = whole(key, value, 2, 32);
  } else if (key == "watchdog_ms") {
    options.watchdog_ms = whole(key, value, 1, 60'000);
  } else {
    refuse(key, value, std::string("the keys are ") + kKeys);
  }
}

}  // namespace

V4l2Options parse_v4l2(const std::string& text) {
  std::istringstream parts(text);
  std::string part;
  std::getline(parts, part, ',');
  V4l2Options options;
  options.path = device_path(part);
  while (std::getline(parts, part, ',')) {
    const std::size_t equals = part.find('=');
    if (equals == std::string::npos) refuse(part, "", std::string("give KEY=VALUE; the keys are ") + kKeys);
    set(options, part.substr(0, equals), part.substr(equals + 1));
  }
  if ((options.width == 0) != (options.height == 0)) {
    throw bad_field(kSource, options.width == 0 ? "v4l2:…,width" : "v4l2:…,height", "missing",
                    "give width and height, or neither");
  }
  return options;
}

}  // namespace berth
