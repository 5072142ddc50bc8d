#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "berth/camera.hpp"
#include "pose_algebra.hpp"
#include "target/refine_pose.hpp"
#include "target/symmetric.hpp"

namespace berth {

/// Normal equations of corners at one pose, in units of standard deviations; of the matrix the lower triangle.
struct PoseNormal {
  SquareMatrix<6> matrix = {};
  std::array<double, 6> gradient = {};  // minus half the sum of squares' derivative
  double squares = 0;
  double squares_px = 0;

  /// A row of weight 1.
  void add_row(const std::array<double, 6>& row, double residual) {
    for (std::size_t i = 0; i < 6; ++i) {
      gradient[i] += row[i] * residual;
      for (std::size_t j = 0; j <= i; ++j) matrix[i * 6 + j] += row[i] * row[j];
    }
    squares += residual * residual;
  }

  /// The rows of two image coordinates that are `off` (px) and have this covariance (px^2: of x, of x with y, of y);
  /// false where that is none.
  bool add_pair(const std::array<std::array<double, 6>, 2>& rows, const Vec2& off,
                const std::array<double, 3>& covariance_px2) {
    squares_px += off[0] * off[0] + off[1] * off[1];
    // Whitened by the inverse of the covariance's factor: (1/a, 0; -b/(a c), 1/c) of (a, 0; b, c).
    const double a = std::sqrt(covariance_px2[0]), b = covariance_px2[1] / a;
    const double rest = covariance_px2[2] - b * b;
    if (!(a > 0) || !(rest > 0)) return false;
    const double c = std::sqrt(rest);
    std::array<double, 6> first{}, second{};
    for (std::size_t i = 0; i < 6; ++i) {
      first[i] = rows[0][i] / a;
      second[i] = (rows[1][i] - b * first[i]) / c;
    }
    const double e0 = off[0] / a;
    add_row(first, e0);
    add_row(second, (off[1] - b * e0) / c);
    return true;
  }
};

/// The two rows of a corner that lies at `at` in the camera frame. `row_of` takes the derivative of an image
/// coordinate by the point in the camera frame (px/m) to that by a step of the pose. Returns false where the point is
/// not before the camera or its covariance is none.
template <class RowOf>
bool add_seen(const CameraModel& camera, const Vec3& at, const PoseCorner& corner, PoseNormal& normal, RowOf row_of) {
  constexpr double kNearest_m = 1e-6;
  if (!(at[2] > kNearest_m)) return false;
  const double x = at[0] / at[2], y = at[1] / at[2];
  std::array<double, 4> lens{};
  const Vec2 image = camera.project(x, y, lens);
  std::array<std::array<double, 6>, 2> rows{};
  for (std::size_t k = 0; k < 2; ++k) {
    const double dx = lens[2 * k] / at[2], dy = lens[2 * k + 1] / at[2];
    rows[k] = row_of(Vec3{dx, dy, -(dx * x + dy * y)});
  }
  return normal.add_pair(rows, {corner.seen_px[0] - image[0], corner.seen_px[1] - image[1]}, corner.covariance_px2);
}

/// The row of an image coordinate: its derivative by a point, where a step of the pose moves that by dt + w x arm.
inline std::array<double, 6> step_row(const Vec3& by_point, const Vec3& arm) {
  const Vec3 by_turn = cross(arm, by_point);  // by_point · (w × arm)
  return {by_point[0], by_point[1], by_point[2], by_turn[0], by_turn[1], by_turn[2]};
}

/// A corner of a target at `pose` in the camera frame: derivatives by translation, then rotation about the camera's
/// axes.
inline bool add_corner(const CameraModel& camera, const Pose& pose, const PoseCorner& corner, PoseNormal& normal) {
  const Vec3 arm = product(pose.R, corner.point_m);
  return add_seen(camera, add(arm, pose.t), corner, normal,
                  [&](const Vec3& by_point) { return step_row(by_point, arm); });
}

/// Levenberg-Marquardt from a pose nearby. `linearise(pose, normal)` fills the normal equations, or returns false where
/// there are none. Gives pose, covariance and chi_square, and the sum of squares in px; false where the start has no
/// normal equations, they do not determine the pose, or 30 steps do not come to an end.
template <class Linearise>
bool least_squares_pose(const Pose& start, Linearise linearise, RefinedPose& result, double& squares_px) {
  // Steps end when one promises to lower the sum of squares (standard deviations) by less than the first share of it.
  // Where a plane's two poses have become one, least squares are as flat as a fourth power and come nearer ever more
  // slowly: what promises less than the second share there is within the noise.
  constexpr int kMostSteps = 30;
  constexpr double kLeastGain = 1e-9, kEnough = 1e-3;
  // Relative to the diagonal. Below the least it is as good as none, and would only take longer to rise again.
  constexpr double kFirstDamping = 1e-4, kLeastDamping = 1e-7;

  const auto at = [&](const Pose& pose, PoseNormal& normal) {
    normal = {};
    return linearise(pose, normal) && finite(normal.squares);
  };
  PoseNormal here;
  Pose pose = start;
  if (!at(pose, here)) return false;
  double damping = kFirstDamping;
  double gain = 1;  // relative, that the last step promised
  for (int k = 0; k < kMostSteps && gain > kLeastGain; ++k) {
    SquareMatrix<6> damped = here.matrix;
    for (std::size_t i = 0; i < 6; ++i) damped[i * 6 + i] *= 1 + damping;
    if (!factorise<6>(damped)) return false;
    const std::array<double, 6> step = solve<6>(damped, here.gradient);
    double promised = 0;
    for (std::size_t i = 0; i < 6; ++i) promised += step[i] * here.gradient[i];
    const Pose next = moved(pose, step);
    PoseNormal there;
    if (at(next, there) && there.squares <= here.squares) {
      pose = next;
      here = there;
      damping = std::max(kLeastDamping, damping * 0.1);
    } else {
      damping *= 10;
    }
    gain = promised / (1 + here.squares);
  }
  if (!(gain < kEnough) || !invert<6>(here.matrix, result.covariance)) return false;
  result.pose = pose;
  result.chi_square = here.squares;
  squares_px = here.squares_px;
  return true;
}

}  // namespace berth
