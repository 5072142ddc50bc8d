#include "target/refine_pose.hpp"

#include <cmath>

#include "target/pose_steps.hpp"

namespace berth {
namespace {

// In squares of standard deviations.
constexpr double kSame = 0.01;

// The distance from what was expected.
void add_prior(const Pose& pose, const PosePrior& prior, PoseNormal& normal) {
  const std::array<double, 6> off = step_between(prior.pose, pose);
  const SquareMatrix<6> by_step = by_small_step(off);
  const SquareMatrix<6> weighted = multiply<6>(transposed<6>(by_step), prior.information);
  const SquareMatrix<6> matrix = multiply<6>(weighted, by_step);
  const std::array<double, 6> gradient = multiply<6>(weighted, off);
  for (std::size_t i = 0; i < 6; ++i) normal.gradient[i] -= gradient[i];
  for (std::size_t i = 0; i < 36; ++i) normal.matrix[i] += matrix[i];
  normal.squares += quadratic<6>(prior.information, off);
}

// `add_part(i, pose, normal)` adds part i of `parts`, which have so many corners together.
template <class AddPart>
bool refine_by(std::size_t parts, AddPart add_part, std::size_t corners, const Pose& start, RefinedPose& result,
               const PosePrior* prior) {
  if (corners < 3) return false;
  const auto linearise = [&](const Pose& pose, PoseNormal& normal) {
    for (std::size_t i = 0; i < parts; ++i) {
      if (!add_part(i, pose, normal)) return false;
    }
    if (prior != nullptr) add_prior(pose, *prior, normal);
    return true;
  };
  double squares_px = 0;
  if (!least_squares_pose(start, linearise, result, squares_px)) return false;
  result.error_px = std::sqrt(squares_px / static_cast<double>(corners));
  return true;
}

}  // namespace

bool refine_pose(const CameraModel& camera, const PoseCorner* corners, std::size_t count, const Pose& start,
                 RefinedPose& result, const PosePrior* prior) {
  return refine_by(
      count,
      [&](std::size_t i, const Pose& pose, auto& normal) { return add_corner(camera, pose, corners[i], normal); },
      count, start, result, prior);
}

bool refine_pose(const CameraModel& camera, const SeenCorners* markers, std::size_t count, const Pose& start,
                 RefinedPose& result, const PosePrior* prior) {
  std::size_t corners = 0;
  for (std::size_t i = 0; i < count; ++i) corners += markers[i].count;
  return refine_by(
      count,
      [&](std::size_t i, const Pose& pose, auto& normal) { return add_corners(camera, pose, markers[i], normal); },
      corners, start, result, prior);
}

bool SeenCorners::set_covariance(const CornerCovariance& covariance_px2) {
  factor = covariance_px2;
  return factorise<8>(factor, 1e-14, 2 * count);
}

double whitened_square(const Vec2& off_px, const std::array<double, 3>& covariance_px2) {
  const auto& [xx, xy, yy] = covariance_px2;
  const double x = off_px[0], y = off_px[1];
  return (yy * x * x - 2 * xy * x * y + xx * y * y) / (xx * yy - xy * xy);
}

PoseUncertainty uncertainty_of(const RefinedPose& found, const RefinedPose* other) {
  PoseUncertainty known;
  known.covariance = found.covariance;
  known.error_px = found.error_px;
  known.chi_square = found.chi_square;
  if (other != nullptr) {
    known.has_other = true;
    known.other = other->pose;
    known.other_error_px = other->error_px;
    known.other_covariance = other->covariance;
    known.other_excess = other->chi_square - found.chi_square;
  }
  return known;
}

bool same_pose(const RefinedPose& a, const RefinedPose& b) {
  SquareMatrix<6> information{};
  return invert<6>(a.covariance, information) && quadratic<6>(information, step_between(a.pose, b.pose)) < kSame;
}

}  // namespace berth
