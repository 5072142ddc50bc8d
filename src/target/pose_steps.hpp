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
  /// What `matrix` lacks of half the sum of squares' second derivative, minus the residuals times the image's second
  /// derivatives; 0 where that is not known. The lower triangle. A pose's information is `matrix` alone.
  SquareMatrix<6> bend = {};
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

/// Of steps to which the image's bend is not known.
struct NoBend {
  void operator()(std::size_t, const Vec3&, double) const {}
};

/// The rows of corners. `place_of(i)` is where corner i is in the camera frame, `row_of(i, by_point)` takes the
/// derivative of an image coordinate by that point (px/m) to that by a step of the pose. `add_bend(i, pull, depth_m)`
/// may add to the normal equations' bend: the residuals pull at that point, minus half the sum of squares' derivative
/// by it. Returns false where a point is not before the camera.
template <class PlaceOf, class RowOf, class AddBend = NoBend>
bool add_seen(const CameraModel& camera, const SeenCorners& corners, PoseNormal& normal, PlaceOf place_of, RowOf row_of,
              AddBend add_bend = {}) {
  constexpr double kNearest_m = 1e-6;
  std::array<std::array<double, 6>, 8> rows{};
  std::array<double, 8> off{};
  std::array<std::array<Vec3, 2>, 4> by_point{};
  std::array<double, 4> depth_m{};
  const std::size_t count = 2 * corners.count;
  for (std::size_t i = 0; i < corners.count; ++i) {
    const Vec3 at = place_of(i);
    if (!(at[2] > kNearest_m)) return false;
    const double x = at[0] / at[2], y = at[1] / at[2];
    depth_m[i] = at[2];
    std::array<double, 4> lens{};
    const Vec2 image = camera.project(x, y, lens);
    for (std::size_t k = 0; k < 2; ++k) {
      const double dx = lens[2 * k] / at[2], dy = lens[2 * k + 1] / at[2];
      by_point[i][k] = {dx, dy, -(dx * x + dy * y)};
      rows[2 * i + k] = row_of(i, by_point[i][k]);
      off[2 * i + k] = corners.seen_px[i][k] - image[k];
      normal.squares_px += off[2 * i + k] * off[2 * i + k];
    }
  }
  // Whitened: the covariance's factor solved for them.
  for (std::size_t i = 0; i < count; ++i) {
    const double* const factor = &corners.factor[8 * i];
    for (std::size_t j = 0; j < i; ++j) {
      for (std::size_t k = 0; k < 6; ++k) rows[i][k] -= factor[j] * rows[j][k];
      off[i] -= factor[j] * off[j];
    }
    for (double& value : rows[i]) value /= factor[i];
    off[i] /= factor[i];
    normal.add_row(rows[i], off[i]);
  }
  // And by its transpose: the covariance's inverse times the residuals.
  for (std::size_t i = count; i-- > 0;) {
    for (std::size_t j = i + 1; j < count; ++j) off[i] -= corners.factor[8 * j + i] * off[j];
    off[i] /= corners.factor[8 * i + i];
  }
  for (std::size_t i = 0; i < corners.count; ++i) {
    add_bend(i, add(scaled(by_point[i][0], off[2 * i]), scaled(by_point[i][1], off[2 * i + 1])), depth_m[i]);
  }
  return true;
}

/// The row of an image coordinate: its derivative by a point, where a step of the pose moves that by dt + w x arm.
inline std::array<double, 6> step_row(const Vec3& by_point, const Vec3& arm) {
  const Vec3 by_turn = cross(arm, by_point);  // by_point · (w × arm)
  return {by_point[0], by_point[1], by_point[2], by_turn[0], by_turn[1], by_turn[2]};
}

/// What the residuals' pull at a point adds to the bend: perspective's, by which an image coordinate with derivative g
/// has the second derivative -2 (g · d) d_z / depth along a displacement d, and the turn's, since a turn w displaces by
/// w x arm + w x (w x arm) / 2. The lens is taken as linear there.
inline void add_step_bend(const Vec3& pull, double depth_m, const Vec3& arm, SquareMatrix<6>& bend) {
  const std::array<double, 6> along = step_row(pull, arm), deeper = step_row({0, 0, 1}, arm);
  for (std::size_t i = 0; i < 6; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      bend[i * 6 + j] += (along[i] * deeper[j] + deeper[i] * along[j]) / depth_m;
    }
  }
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j <= i; ++j) {
      const double turn = (arm[i] * pull[j] + pull[i] * arm[j]) / 2 - (i == j ? dot(arm, pull) : 0);
      bend[(i + 3) * 6 + j + 3] -= turn;
    }
  }
}

/// Corners of a target at `pose` in the camera frame: derivatives by translation, then rotation about the camera's
/// axes.
inline bool add_corners(const CameraModel& camera, const Pose& pose, const SeenCorners& corners, PoseNormal& normal) {
  std::array<Vec3, 4> arms{};
  for (std::size_t i = 0; i < corners.count; ++i) arms[i] = product(pose.R, corners.points_m[i]);
  return add_seen(
      camera, corners, normal, [&](std::size_t i) { return add(arms[i], pose.t); },
      [&](std::size_t i, const Vec3& by_point) { return step_row(by_point, arms[i]); },
      [&](std::size_t i, const Vec3& pull, double depth_m) { add_step_bend(pull, depth_m, arms[i], normal.bend); });
}

/// One corner; false too where its covariance is none.
inline bool add_corner(const CameraModel& camera, const Pose& pose, const PoseCorner& corner, PoseNormal& normal) {
  SeenCorners one;
  one.count = 1;
  one.points_m[0] = corner.point_m;
  one.seen_px[0] = corner.seen_px;
  const auto& [xx, xy, yy] = corner.covariance_px2;
  CornerCovariance covariance{};
  covariance[0] = xx;
  covariance[1] = covariance[8] = xy;
  covariance[9] = yy;
  return one.set_covariance(covariance) && add_corners(camera, pose, one, normal);
}

/// Levenberg-Marquardt from a pose nearby. `linearise(pose, normal)` fills the normal equations, or returns false where
/// there are none. Gives pose, covariance and chi_square, and the sum of squares in px; false where the start has no
/// normal equations, they do not determine the pose, or 30 steps do not come to an end.
template <class Linearise>
bool least_squares_pose(const Pose& start, Linearise linearise, RefinedPose& result, double& squares_px) {
  // Steps end when one promises to lower the sum of squares (standard deviations) by less than the first share of it.
  // Where there is no bend to go by, or no minimum near, what promises less than the second share is within the noise.
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
    // With the bend where that leaves a minimum, as it does near the end. Without it, where a plane's two poses become
    // one, steps go twice as far as they should, to and fro, and come nearer ever more slowly.
    SquareMatrix<6> damped = here.matrix;
    for (std::size_t i = 0; i < 6; ++i) damped[i * 6 + i] *= 1 + damping;
    SquareMatrix<6> bent = damped;
    for (std::size_t i = 0; i < 36; ++i) bent[i] += here.bend[i];
    if (factorise<6>(bent)) {
      damped = bent;
    } else if (!factorise<6>(damped)) {
      return false;
    }
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
