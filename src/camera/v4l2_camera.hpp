#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "berth/image.hpp"
#include "camera/v4l2_device.hpp"

namespace berth {

/// What a Video4Linux camera is set to; 0 (or -1 where 0 means something) leaves it as it is.
struct V4l2Options {
  /// "/dev/video0"; names that stay the same after a restart are in /dev/v4l/by-path and by-id.
  std::string path;
  int width = 0, height = 0;
  double fps = 0;
  /// Four characters, e.g. "GREY"; empty picks the first the camera has of those that v4l2_formats() lists.
  std::string format;
  /// Time of exposure, µs; given, the camera's own control of it is switched off. The driver rounds it to 100 µs.
  int exposure_us = -1;
  int gain = -1;
  /// Buffers that the driver fills while others are looked at, 2 to 32.
  int buffers = 4;
  /// Without a whole frame for this long, 1 to 60,000, the camera is closed and opened again.
  int watchdog_ms = 1000;
};

/// Options of a source's name without "v4l2:": "PATH[,KEY=VALUE...]", PATH as above, or by-path/NAME, by-id/NAME,
/// video0. Throws Error that names the key, its value and the remedy.
V4l2Options parse_v4l2(const std::string& text);

/// The pixel formats that can be read, best first, e.g. "GREY".
std::vector<std::string> v4l2_formats();

/// A camera that is streaming. Made, it is set up and all its buffers are with the driver.
class V4l2Camera {
 public:
  /// Throws Error "PATH: …" on a device that is no camera, or does not do what the options ask.
  V4l2Camera(std::unique_ptr<V4l2Device> device, const V4l2Options& options);

  /// A buffer that the driver has filled, until it is given back.
  struct Filled {
    std::uint32_t index = 0;
    std::uint32_t sequence = 0;
    std::size_t bytes = 0;
    /// On CLOCK_MONOTONIC where `monotonic`, at the start of exposure where `from_start`, else when the frame was
    /// there.
    std::int64_t time_ns = 0;
    bool monotonic = false, from_start = false;
    /// The driver says that data are missing.
    bool damaged = false;
  };
  /// Takes a filled buffer, waiting so long. Returns 0, ETIMEDOUT, or another errno: the camera is then of no more use.
  int take(int timeout_ms, Filled& filled);
  /// Back to the driver.
  int give_back(const Filled& filled);
  /// Writes the image in that buffer as 8-bit gray, width() x height(). False where it is incomplete. Allocates where
  /// the camera compresses (MJPG).
  bool read(const Filled& filled, View2D<u8> image) const;

  int width() const { return width_; }
  int height() const { return height_; }
  /// 0 where the options left it to the camera.
  std::int64_t exposure_ns() const { return exposure_ns_; }

 private:
  void check_capabilities();
  void choose_format();
  void set_size();
  void set_rate();
  void set_controls();
  void start();
  /// Throws Error "PATH: `what`".
  [[noreturn]] void fail(const std::string& what) const;

  std::unique_ptr<V4l2Device> device_;
  V4l2Options options_;
  std::uint32_t fourcc_ = 0;
  int width_ = 0, height_ = 0;
  std::size_t stride_ = 0;
  std::int64_t exposure_ns_ = 0;
  std::vector<const u8*> buffers_;
};

}  // namespace berth
