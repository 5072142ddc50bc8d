#pragma once

#include <array>
#include <cstddef>

#include "berth/marker.hpp"

namespace berth::table {

/// x, y, z (m), then rx, ry, rz (rad), camera frame.
using SixAxes = std::array<double, 6>;

/// How far a pose is from the truth: its translation less the true one, and the rotation vector of found · trueᵀ, that
/// is about axes parallel to the camera's, as a pose's covariance has it. Turns below 180°.
SixAxes pose_error(const Pose& found, const Pose& truth);

/// Statistics of errors of one kind, in their unit.
class ErrorSum {
 public:
  void add(double error);

  int count() const { return count_; }
  /// 0 of none, as are the others.
  double mean() const;
  /// Root mean square about zero, that is about the truth.
  double rms() const;
  /// Standard deviation about the mean; 0 of fewer than two.
  double deviation() const;
  /// Largest magnitude.
  double largest() const { return largest_; }

 private:
  int count_ = 0;
  double mean_ = 0, about_mean_ = 0, squares_ = 0, largest_ = 0;
};

/// Errors of one way to measure over one sweep.
struct SweepErrors {
  /// Frames that showed the marker wholly, and those of them with a pose.
  int shown = 0, found = 0;
  std::array<ErrorSum, 6> axes;
  /// Those of x, y, z as shares of the true distance from the camera; then the whole displacement's.
  std::array<ErrorSum, 3> shares;
  ErrorSum position_share;
  /// Distance of a corner from its true place, px.
  ErrorSum corners_px;

  void add(const Pose& pose, const Pose& truth);
  void add_corners(const std::array<std::array<double, 2>, 4>& seen, const std::array<std::array<double, 2>, 4>& truth);
};

/// Errors of the best estimator there could be over one sweep, from each frame's own bound (corner_bound.hpp).
class SweepBound {
 public:
  /// A frame's: standard deviation of each axis, RMS distance of a corner (px), distance from the camera.
  void add(const SixAxes& deviations, double corner_px, double range_m);

  int count() const { return axes_[0].count(); }
  /// Root mean square over the frames: what SweepErrors' RMS would be expected to be.
  double rms(std::size_t axis) const { return axes_[axis].rms(); }
  /// Standard deviation of that RMS over so few frames, normal errors taken.
  double rms_deviation(std::size_t axis) const;
  double share(std::size_t axis) const { return shares_[axis].rms(); }
  double position_share() const { return position_share_.rms(); }
  double corners_px() const { return corners_px_.rms(); }

 private:
  std::array<ErrorSum, 6> axes_, squares_;
  std::array<ErrorSum, 3> shares_;
  ErrorSum position_share_, corners_px_;
};

}  // namespace berth::table
