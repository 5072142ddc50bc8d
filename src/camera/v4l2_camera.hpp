#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "berth/image.hpp"
#include "camera/live_camera.hpp"
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
  /// LiveOptions::repeats
  bool repeats = false;
};

/// Options of a source's name without "v4l2:": "PATH[,KEY=VALUE...]", PATH as above, or by-path/NAME, by-id/NAME,
/// video0. Throws Error that names the key, its value and the remedy.
V4l2Options parse_v4l2(const std::string& text);

/// The pixel formats that can be read, best first, e.g. "GREY".
std::vector<std::string> v4l2_formats();

/// A camera that is streaming. Made, it is set up and all its buffers are with the driver.
class V4l2Camera final : public LiveCamera {
 public:
  /// Throws Error "PATH: …" on a device that is no camera, or does not do what the options ask.
  V4l2Camera(std::unique_ptr<V4l2Device> device, const V4l2Options& options);

  int take(int timeout_ms, Filled& filled) override;
  int give_back(const Filled& filled) override;
  /// Allocates where the camera compresses (MJPG).
  bool read(const Filled& filled, View2D<u8> image) const override;

  int width() const override { return width_; }
  int height() const override { return height_; }
  /// 0 where the options left it to the camera.
  std::int64_t exposure_ns() const override { return exposure_ns_; }

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
