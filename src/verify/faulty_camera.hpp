#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <vector>

#include "berth/image.hpp"
#include "berth/source.hpp"
#include "camera/live_camera.hpp"
#include "sim/random.hpp"

namespace berth {

/// What goes wrong with a camera.
enum class CameraFault {
  none,
  dropped,   ///< one to three frames do not come
  doubled,   ///< a frame comes twice
  torn,      ///< the lower part is the frame's before
  half,      ///< data are missing: the driver says so, or reading finds out
  frozen,    ///< the same picture two to six times more, with times that go on
  back,      ///< a frame's time is before the last one's
  ahead,     ///< a frame's time is ten seconds ahead
  set_back,  ///< the camera's clock is set back by five seconds, for good
  gone,      ///< unplugged, and back after one or two attempts in vain
  resized,   ///< back with images of half the width and height, then as before
  black,     ///< no light
  white,     ///< too much of it
};
constexpr std::size_t kCameraFaults = 13;
const char* name_of(CameraFault fault);
/// What is to become of it: "lost", "repeated", "handed on", …
const char* fate_of(CameraFault fault);

/// A frame that the camera handed over whole.
struct FilmedFrame {
  /// Of those with data; counts on over dropped ones.
  u64 number = 0;
  CameraFault fault = CameraFault::none;
  /// Which of the pictures it shows, with the noise of frame `noise`; of a torn one, which the rows from `seam` on
  /// show.
  std::size_t picture = 0, below = 0;
  u64 noise = 0;
  int seam = 0;
  std::int64_t time_ns = 0;
  /// How often the camera's clock was set back before.
  int clock = 0;
};

struct FaultyFilmOptions {
  u64 seed = 1;
  /// With faults in them; those after are without.
  u64 frames = 100;
  double frames_per_second = 60;
  /// How likely a fault begins with a frame, where the last one is six frames ago.
  double share = 0.1;
  std::vector<CameraFault> kinds;
  /// Frames come when they are due, with times on the monotonic clock. Otherwise at once, on the clock "simulation".
  bool in_real_time = false;
};

/// What a camera that is not there sees: pictures to and fro, over and over, with faults that a seed repeats. It
/// outlives the cameras that are opened on it, which are used one after the other (open_live).
class FaultyFilm {
 public:
  /// Pictures of one size, two or more.
  FaultyFilm(std::vector<GrayImage> pictures, const FaultyFilmOptions& options);
  ~FaultyFilm();
  FaultyFilm(const FaultyFilm&) = delete;
  FaultyFilm& operator=(const FaultyFilm&) = delete;

  LiveCameraOpener opener();
  /// The frame read last. On the thread that reads.
  const FilmedFrame& last() const;
  /// Writes what a frame looks like into an image of its size. From any thread.
  void draw(const FilmedFrame& frame, View2D<u8> image) const;

  /// How often each fault began. On the thread that reads, as is expected().
  const std::array<u64, kCameraFaults>& begun() const;
  /// What whoever reads must have counted by now; skipped stays 0.
  const SourceHealth& expected() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace berth
