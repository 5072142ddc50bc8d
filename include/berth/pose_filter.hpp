#pragma once

#include <array>
#include <cstdint>
#include <memory>

#include "berth/camera.hpp"
#include "berth/marker.hpp"

namespace berth {

struct PoseFilterConfig {
  CameraModel camera;
  /// Side of the marker, m.
  double marker_size_m = 0;
  /// One standard deviation of a corner's coordinate, px, of markers without a covariance of their own.
  double corner_deviation_px = 0.15;
  /// How velocities change unforeseen: their standard deviation after one second, m/s and rad/s (a random walk).
  double acceleration = 0.5;
  double angular_acceleration = 0.3;
  /// What velocities may be when the marker is first seen, one standard deviation, m/s and rad/s.
  double first_velocity = 0.3;
  double first_angular_velocity = 0.3;
  /// A frame whose corners fit nothing foreseen by more than this is kept out: chi-square of 8 degrees of freedom,
  /// exceeded by one frame in 30,000 where the model holds.
  double gate = 35;
  /// More frames than so many kept out in a row begin anew.
  int most_outliers = 5;
  /// The track ends after this time without a marker, s.
  double lost_s = 0.5;
  /// The other solution is ruled out when it fits worse by so much, in squares of standard deviations (e^-12.5 as
  /// likely), after so many frames.
  double sure = 25;
  int sure_frames = 20;
};

/// The pose at a frame's time, from this frame and those before it.
struct FilteredPose {
  std::int64_t time_ns = 0;
  /// There is a track. False: nothing was seen, for `lost_s` or ever, or the frame's time is before the last one's.
  bool has_pose = false;
  /// This frame's marker went into it. False: it is foretold from earlier frames.
  bool measured = false;
  /// A marker was read, and kept out, as it does not fit.
  bool outlier = false;
  /// The other solution of the planar pose (or another motion) is ruled out by the frames so far.
  bool sure = false;
  /// The pose does not go on from the last frame's: the other solution is now more likely, or the track began anew.
  bool jumped = false;
  Pose pose;
  /// As PoseUncertainty's.
  std::array<double, 36> covariance = {};
  /// m/s, then rad/s about axes parallel to the camera's, of the marker in the camera frame; their covariance.
  std::array<double, 6> velocity = {};
  std::array<double, 36> velocity_covariance = {};
  /// Seconds since a marker went in.
  double age_s = 0;
};

/// A marker's pose over time: a Kalman filter of pose and constant velocity whose measurements are the corners
/// themselves, for each way the planar poses of the frames may be joined; the most likely one is given
/// (docs/pose-filter.md). Takes all its memory when it is made.
class PoseFilter {
 public:
  /// Throws Error on a size, a deviation or a time that is not above 0.
  explicit PoseFilter(const PoseFilterConfig& config);
  ~PoseFilter();
  PoseFilter(PoseFilter&&) noexcept;
  PoseFilter& operator=(PoseFilter&&) noexcept;

  /// A frame of that time (mid-exposure, ns); `marker` with a pose, or null where it was not read. Frames come in their
  /// order in time; one that does not is kept out and has no pose. The track begins anew where time goes back by more
  /// than `lost_s`, or for more than `most_outliers` frames in a row. Valid until the next call.
  const FilteredPose& update(std::int64_t mid_exposure_ns, const Detection* marker);
  /// What the last frame says of another time, later for what has to reach an actuator: measured is false there.
  FilteredPose foretell(std::int64_t time_ns) const;
  /// Ends the track.
  void reset();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace berth
