#pragma once

#include <array>
#include <memory>
#include <optional>
#include <string>

#include "berth/backend.hpp"
#include "berth/camera.hpp"
#include "berth/frame.hpp"
#include "berth/health.hpp"
#include "berth/image.hpp"

namespace berth {

struct NavigatorConfig {
  /// The network's file (.berthnet).
  std::string network;
  /// With a camera, a sighting has bearing and range.
  std::optional<CameraModel> camera;
  /// Diameter of the sphere around the target, m.
  double target_diameter_m = 0.4;
  /// Least score where a target was seen in the last frames but is not believed yet, or was lost and found, Q15.
  int threshold_q15 = 16384;
  /// Least score where a target is followed that is believed, Q15: lower, since so much speaks for it already.
  int keep_threshold_q15 = 8192;
  /// Least score of what a search found, Q15. Higher: of the hundreds of places in a frame the best is taken, and where
  /// there is no target that is something like it (docs/navigation.md has the figures).
  int first_threshold_q15 = 29491;
  /// A target is believed once frames running have so much evidence for it: the sum of their log-odds, each less
  /// `doubt` and at most `most_evidence`. 0 believes the first.
  double evidence = 4, doubt = 1.5, most_evidence = 2;
  /// Least score of a place in the whole image that is worth a closer look, Q15.
  int search_threshold_q15 = 8192;
  /// One standard deviation of the range, as a share of it: 68 % of the errors of the network that comes with Berth lie
  /// within (models/README.md).
  double range_deviation = 0.12;
  /// With it, weights and tables in the host's memory are checked before each look, and now and then all plans run on a
  /// picture of which the `cpu` backend's sums are known. Once either fails, every look is device_lost; its recovery is
  /// not used.
  std::optional<HealthConfig> health;
};

/// What the network says of a frame.
struct Sighting {
  FrameStamp stamp;
  /// ok, no_target or device_lost.
  FrameStatus status = FrameStatus::no_target;
  /// Of the windows that it is from, or of the best one looked at, Q15.
  int score_q15 = 0;
  /// Centre of the target and its circumscribed diameter, px of the frame in 1/65536.
  std::int64_t x_q16 = 0;
  std::int64_t y_q16 = 0;
  std::int64_t d_q16 = 0;
  /// The window that gave them, of several the first: corner and pixel size in 1/256 px of the frame.
  std::array<s32, 3> window = {};
  /// At the place where the frames before had it.
  bool tracked = false;
  /// Something is there that is not believed yet; status is no_target.
  bool doubted = false;
  /// Places that the search put forward.
  int candidates = 0;
  /// With a camera: unit vector from it to the target in its frame, distance along it and its standard deviation, m.
  bool has_range = false;
  std::array<double, 3> bearing = {};
  double range_m = 0;
  double range_deviation_m = 0;
};

/// Finds the target in frames of one size with a network (docs/navigation.md). All memory is taken in the constructor.
class Navigator {
 public:
  /// Throws Error on a size outside 64 to 16384, a bad network or configuration.
  Navigator(Backend& backend, int width, int height, const NavigatorConfig& config);
  ~Navigator();
  Navigator(Navigator&&) noexcept;
  Navigator& operator=(Navigator&&) noexcept;

  /// Follows the target if the last frame had it, else searches. Valid until the next call.
  const Sighting& look(View2D<const u8> image, const FrameStamp& stamp = {});
  /// Makes the next frame search.
  void forget();
  /// Makes the next frame look here first: a target's centre and diameter, px of the frame.
  void expect(double x_px, double y_px, double d_px);

  /// nominal or failed; from any thread.
  HealthReport health() const;

  /// Bytes of device memory, all taken at start.
  std::size_t device_bytes() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace berth
