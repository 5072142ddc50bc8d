#include "table/consistency.hpp"

#include <cmath>

#include "target/symmetric.hpp"

namespace berth::table {
namespace {

constexpr double kPoseQuantile = 12.592;
// In squares of standard deviations, that the other pose must fit worse: about a hundredth as likely.
constexpr double kClear = 9;

}  // namespace

std::array<double, 2> honest_bounds(int count, int freedom) {
  const double wide = 1.96 * std::sqrt(2.0 / (static_cast<double>(count) * freedom));
  return {1 - wide, 1 + wide};
}

void Consistency::add(const Detection& detection, const TruthMarker& truth) {
  if (detection.corner_covariance_px2) {
    std::array<double, 8> off{};
    for (std::size_t i = 0; i < 8; ++i) off[i] = detection.corners[i / 2][i % 2] - truth.corners[i / 2][i % 2];
    SquareMatrix<8> information{};
    if (invert<8>(*detection.corner_covariance_px2, information)) corners_.add(quadratic<8>(information, off) / 8);
    for (std::size_t i = 0; i < 4; ++i)
      distance_px_.add(std::sqrt(off[2 * i] * off[2 * i] + off[2 * i + 1] * off[2 * i + 1]));
  }
  if (!detection.has_pose || !detection.pose_uncertainty) return;
  const PoseUncertainty& known = *detection.pose_uncertainty;
  if (known.has_other && known.other_excess < kClear) {
    ++ambiguous_;
    return;
  }
  const SixAxes error = pose_error(detection.pose, truth.pose);
  SquareMatrix<6> information{};
  if (!invert<6>(known.covariance, information)) return;
  const double squares = quadratic<6>(information, error);
  pose_.add(squares / 6);
  outside_ += squares > kPoseQuantile ? 1 : 0;
  for (std::size_t i = 0; i < 6; ++i) axes_[i].add(error[i] * error[i] / known.covariance[7 * i]);
}

}  // namespace berth::table
