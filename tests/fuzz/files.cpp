// The files that Berth reads, but for recordings. A file that is read holds what its reader promises.
#include <algorithm>
#include <cmath>
#include <memory>
#include <string>
#include <string_view>

#include "berth/bundle.hpp"
#include "berth/camera.hpp"
#include "berth/disc_target.hpp"
#include "berth/error.hpp"
#include "berth/systematic_covariance.hpp"
#include "camera/aravis_camera.hpp"
#include "camera/gst_camera.hpp"
#include "camera/image_file.hpp"
#include "camera/recorded_frame.hpp"
#include "camera/ros_image.hpp"
#include "camera/v4l2_camera.hpp"
#include "crc32.hpp"
#include "fuzz/targets.hpp"
#include "navigation/network.hpp"
#include "sim/scenario.hpp"
#include "support/memory_file.hpp"
#include "work/machine.hpp"

namespace berth::fuzz {
namespace {

template <typename Read>
void read_as_file(const u8* bytes, std::size_t count, const Read& read) {
  test::MemoryFile file;
  file.fill(std::string_view(reinterpret_cast<const char*>(bytes), count));
  try {
    read(file.path());
  } catch (const Error& error) {
    // This file, or one beside it that it refers to.
    if (std::string(error.what()).find("/proc/self/fd/") == std::string::npos) require(false, error.what());
  }
}

void parse_bytes(const std::vector<u8>& file) {
  try {
    const Network network = parse_network(file.data(), file.size(), "network");
    const std::vector<u8> written = network_bytes(network);
    require(network_bytes(parse_network(written.data(), written.size(), "network")) == written,
            "what is written is read again");
  } catch (const Error&) {
  }
}

}  // namespace

void camera_file(const u8* bytes, std::size_t count) {
  read_as_file(bytes, count, [](const std::string& path) {
    const CameraModel camera = read_camera(path);
    require(camera.width > 0 && camera.height > 0, "a camera has a size");
    require(camera.fx > 0 && camera.fy > 0 && std::isfinite(camera.fx) && std::isfinite(camera.fy),
            "a camera has a focal length");
    for (const double k : camera.distortion) require(std::isfinite(k), "distortion is finite");
    read_calibration_deviation(path);
  });
}

void bundle_file(const u8* bytes, std::size_t count) {
  read_as_file(bytes, count, [](const std::string& path) {
    for (const Bundle& bundle : read_bundles(path, 0.165)) bundle.check();
  });
}

void disc_target_file(const u8* bytes, std::size_t count) {
  read_as_file(bytes, count, [](const std::string& path) { read_disc_target(path).check(); });
}

void scenario_file(const u8* bytes, std::size_t count) {
  read_as_file(bytes, count, [](const std::string& path) { open_scenario(path); });
}

void machine_file(const u8* bytes, std::size_t count) {
  read_as_file(bytes, count, [](const std::string& path) { work::read_machine(path); });
}

void network_file(const u8* bytes, std::size_t count) {
  std::vector<u8> file(bytes, bytes + count);
  parse_bytes(file);
  if (count < 20) return;
  // With the size and the checksum that fit, a reader looks further.
  const auto put = [&](std::size_t at, u32 word) {
    for (std::size_t i = 0; i < 4; ++i) file[at + i] = static_cast<u8>(word >> (8 * i));
  };
  put(12, static_cast<u32>(count));
  put(count - 4, crc32(file.data(), count - 4));
  parse_bytes(file);
}

/// What berth run writes of a frame in a recording, and of its camera.
void recorded_text(const u8* bytes, std::size_t count) {
  const std::string text(reinterpret_cast<const char*>(bytes), count);
  const auto answers = [](const auto& read) {
    try {
      read();
    } catch (const Error&) {
    }
  };
  answers([&] { read_recorded_camera(text, "recording"); });
  answers([&] { read_recorded_frame(text, "recording"); });
}

/// A message with a picture, as others record it: packed, or as a PNG's or JPEG's bytes.
void recorded_image(const u8* bytes, std::size_t count) {
  if (count == 0) return;
  const std::unique_ptr<u8[]> message(new u8[count - 1]);  // of its own size, so that a byte beyond it is noticed
  std::copy_n(bytes + 1, count - 1, message.get());
  try {
    const RosImage read = read_ros_image(message.get(), count - 1, (bytes[0] & 1) != 0, "recording");
    require(read.image.width() > 0 && read.image.height() > 0, "an image that is read has a size");
  } catch (const Error&) {
  }
}

/// A camera as it is named on the command line.
void source_options(const u8* bytes, std::size_t count) {
  const std::string text(reinterpret_cast<const char*>(bytes), count);
  for (const auto parse : {+[](const std::string& t) { parse_v4l2(t); }, +[](const std::string& t) { parse_aravis(t); },
                           +[](const std::string& t) { parse_gst(t); }}) {
    try {
      parse(text);
    } catch (const Error&) {
    }
  }
}

void image_file(const u8* bytes, std::size_t count) {
  read_as_file(bytes, count, [](const std::string& path) {
    const GrayImage image = read_gray_image(path);
    require(image.width() > 0 && image.height() > 0, "an image that is read has a size");
  });
}

}  // namespace berth::fuzz
