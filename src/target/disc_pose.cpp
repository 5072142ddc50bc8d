#include "target/disc_pose.hpp"

#include <cmath>

#include "pose_algebra.hpp"
#include "target/pose_steps.hpp"

namespace berth {
namespace {

constexpr double kNearest_m = 1e-6;

/// A vector of the camera's plane as px of the image, where the disc is seen.
Vec2 in_px(const std::array<double, 4>& lens, const Vec2& v) {
  return {lens[0] * v[0] + lens[1] * v[1], lens[2] * v[0] + lens[3] * v[1]};
}

/// What the deviation of a place amounts to in the image, px^2: of the mean half axis by the radius.
double place_px2(const SeenDisc& seen, double deviation_m) {
  const double radius_m = seen.disc.diameter_m / 2;
  const double square_px2 = std::sqrt(seen.fitted.axes_px2[0] * seen.fitted.axes_px2[1]);
  return deviation_m * deviation_m / (radius_m * radius_m) * square_px2;
}

bool add_disc(const Pose& pose, const SeenDisc& seen, double deviation_m, PoseNormal& normal) {
  const Vec3 arm = product(pose.R, Vec3{seen.disc.x_m, seen.disc.y_m, 0}), n = column(pose.R, 2);
  const Vec3 p = add(arm, pose.t);
  const double square = seen.disc.diameter_m * seen.disc.diameter_m / 4;
  if (!(p[2] > kNearest_m)) return false;
  // The centre is K (0, 0, 1)ᵀ: ((p_x p_z + r² n_x n_z), (p_y p_z + r² n_y n_z)) / (p_z² - r² (1 - n_z²)).
  const double below = p[2] * p[2] - square * (1 - n[2] * n[2]);
  if (!(below > 0)) return false;
  std::array<std::array<double, 6>, 2> by_plane{};
  Vec2 center{};
  for (std::size_t k = 0; k < 2; ++k) {
    center[k] = (p[k] * p[2] + square * n[k] * n[2]) / below;
    Vec3 by_point = {0, 0, (p[k] - 2 * center[k] * p[2]) / below};
    Vec3 by_normal = {0, 0, square * (n[k] - 2 * center[k] * n[2]) / below};
    by_point[k] = p[2] / below;
    by_normal[k] = square * n[2] / below;
    by_plane[k] = step_row(by_point, arm);
    const Vec3 turned = cross(n, by_normal);  // a turn moves the normal as it moves an arm
    for (std::size_t i = 0; i < 3; ++i) by_plane[k][3 + i] += turned[i];
  }
  const FittedDisc& fitted = seen.fitted;
  std::array<std::array<double, 6>, 2> rows{};
  for (std::size_t i = 0; i < 6; ++i) {
    const Vec2 px = in_px(fitted.lens, {by_plane[0][i], by_plane[1][i]});
    rows[0][i] = px[0];
    rows[1][i] = px[1];
  }
  const Vec2 off = in_px(fitted.lens, {fitted.in_plane.center[0] - center[0], fitted.in_plane.center[1] - center[1]});
  std::array<double, 3> covariance = fitted.covariance_px2;
  const double place = place_px2(seen, deviation_m);
  covariance[0] += place;
  covariance[2] += place;
  return normal.add_pair(rows, off, covariance);
}

}  // namespace

bool disc_ellipse(const Pose& pose, const TargetDisc& disc, Ellipse& ellipse) {
  const Vec3 p = transform(pose, {disc.x_m, disc.y_m, 0}), n = column(pose.R, 2);
  const double square = disc.diameter_m * disc.diameter_m / 4;
  const double below = p[2] * p[2] - square * (1 - n[2] * n[2]);
  if (!(p[2] > kNearest_m && below > 0)) return false;
  const auto dual = [&](std::size_t i, std::size_t j) {
    return p[i] * p[j] - square * ((i == j ? 1 : 0) - n[i] * n[j]);
  };
  const double x = dual(0, 2) / below, y = dual(1, 2) / below;
  ellipse.center = {x, y};
  ellipse.matrix = {x * x - dual(0, 0) / below, x * y - dual(0, 1) / below, y * y - dual(1, 1) / below};
  return true;
}

bool refine_disc_pose(const SeenDisc* discs, std::size_t count, double deviation_m, const Pose& start,
                      RefinedPose& result) {
  const auto linearise = [&](const Pose& pose, PoseNormal& normal) {
    for (std::size_t i = 0; i < count; ++i) {
      if (!add_disc(pose, discs[i], deviation_m, normal)) return false;
    }
    return true;
  };
  double squares_px = 0;
  if (!least_squares_pose(start, linearise, result, squares_px)) return false;
  result.error_px = std::sqrt(squares_px / static_cast<double>(count));
  return true;
}

double center_error_px(const FittedDisc& seen, const Ellipse& expected) {
  const Vec2 off =
      in_px(seen.lens, {seen.in_plane.center[0] - expected.center[0], seen.in_plane.center[1] - expected.center[1]});
  return std::sqrt(off[0] * off[0] + off[1] * off[1]);
}

}  // namespace berth
