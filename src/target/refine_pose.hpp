#pragma once

#include <array>
#include <cstddef>

#include "berth/camera.hpp"
#include "berth/marker.hpp"

namespace berth {

/// A known point of a target and where it was seen.
struct PoseCorner {
  std::array<double, 3> point_m = {};
  std::array<double, 2> seen_px = {};
  /// Of where it was seen, px^2: of u, of u with v, of v.
  std::array<double, 3> covariance_px2 = {1, 0, 1};
};

/// Up to four corners of one marker, whose errors go together.
struct SeenCorners {
  std::size_t count = 0;
  std::array<std::array<double, 3>, 4> points_m = {};
  std::array<std::array<double, 2>, 4> seen_px = {};
  /// Cholesky factor of their covariance, the lower triangle of its first 2 count rows (8 numbers each).
  CornerCovariance factor = {};

  /// False where it is no covariance.
  bool set_covariance(const CornerCovariance& covariance_px2);
};

/// What is known of a pose before its corners are seen.
struct PosePrior {
  Pose pose;
  /// Inverse of its covariance (as PoseUncertainty's).
  std::array<double, 36> information = {};
};

/// A pose after refinement.
struct RefinedPose {
  Pose pose;
  /// As PoseUncertainty's.
  std::array<double, 36> covariance = {};
  /// Root mean square distance of the corners from where the pose says they are, px.
  double error_px = 0;
  /// Sum of squares in standard deviations, those from the prior included: chi-square where the model holds, with
  /// 2 count - 6 degrees of freedom, 2 count with a prior.
  double chi_square = 0;
};

/// Least squares of the corners' reprojection errors, weighted by their covariances, and of the distance from a prior
/// if there is one, from a pose nearby (Levenberg-Marquardt, rotations by Cayley's form). Returns false, and leaves
/// `result` alone, where the start has a corner behind the camera, the corners do not determine the pose, or 30 steps
/// do not come to an end. Needs three corners or more.
bool refine_pose(const CameraModel& camera, const PoseCorner* corners, std::size_t count, const Pose& start,
                 RefinedPose& result, const PosePrior* prior = nullptr);
/// The same of markers.
bool refine_pose(const CameraModel& camera, const SeenCorners* markers, std::size_t count, const Pose& start,
                 RefinedPose& result, const PosePrior* prior = nullptr);

/// Square of a residual (px) in standard deviations of its covariance (px^2: of x, of x with y, of y).
double whitened_square(const std::array<double, 2>& off_px, const std::array<double, 3>& covariance_px2);

/// What is known of `found`, and of the other solution where there is one.
PoseUncertainty uncertainty_of(const RefinedPose& found, const RefinedPose* other);

/// Whether two refinements came to one pose: they differ by less than a tenth of the first's standard deviation.
bool same_pose(const RefinedPose& a, const RefinedPose& b);

}  // namespace berth
