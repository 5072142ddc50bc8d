#include "table/pose_error.hpp"

#include <algorithm>
#include <cmath>

#include "pose_algebra.hpp"

namespace berth::table {

SixAxes pose_error(const Pose& found, const Pose& truth) {
  const Mat3 turn = product(found.R, transposed(truth.R));
  const Vec3 axis = {0.5 * (turn[7] - turn[5]), 0.5 * (turn[2] - turn[6]), 0.5 * (turn[3] - turn[1])};
  const double sine = length(axis);
  const double cosine = 0.5 * (turn[0] + turn[4] + turn[8] - 1);
  const double scale = sine > 1e-12 ? std::atan2(sine, cosine) / sine : 1;
  return {found.t[0] - truth.t[0], found.t[1] - truth.t[1], found.t[2] - truth.t[2],
          scale * axis[0],         scale * axis[1],         scale * axis[2]};
}

void ErrorSum::add(double error) {
  // Welford: exact where the errors are nearly equal.
  ++count_;
  const double before = error - mean_;
  mean_ += before / count_;
  about_mean_ += before * (error - mean_);
  squares_ += error * error;
  largest_ = std::max(largest_, std::fabs(error));
}

double ErrorSum::mean() const { return mean_; }
double ErrorSum::rms() const { return count_ == 0 ? 0 : std::sqrt(squares_ / count_); }
double ErrorSum::deviation() const { return count_ < 2 ? 0 : std::sqrt(about_mean_ / (count_ - 1)); }

void SweepErrors::add(const Pose& pose, const Pose& truth) {
  const SixAxes error = pose_error(pose, truth);
  const double range_m = length(truth.t);
  for (std::size_t i = 0; i < 6; ++i) axes[i].add(error[i]);
  for (std::size_t i = 0; i < 3; ++i) shares[i].add(error[i] / range_m);
  position_share.add(length({error[0], error[1], error[2]}) / range_m);
}

void SweepErrors::add_corners(const std::array<std::array<double, 2>, 4>& seen,
                              const std::array<std::array<double, 2>, 4>& truth) {
  for (std::size_t i = 0; i < 4; ++i) {
    const double dx = seen[i][0] - truth[i][0], dy = seen[i][1] - truth[i][1];
    corners_px.add(std::sqrt(dx * dx + dy * dy));
  }
}

void SweepBound::add(const SixAxes& deviations, double corner_px, double range_m) {
  for (std::size_t i = 0; i < 6; ++i) {
    axes_[i].add(deviations[i]);
    squares_[i].add(deviations[i] * deviations[i]);
  }
  for (std::size_t i = 0; i < 3; ++i) shares_[i].add(deviations[i] / range_m);
  position_share_.add(length({deviations[0], deviations[1], deviations[2]}) / range_m);
  corners_px_.add(corner_px);
}

double SweepBound::rms_deviation(std::size_t axis) const {
  // The sum S of squares has the variance 2 Σσ⁴; √(S / n) that over 4 n S.
  const double mean_square = squares_[axis].mean(), fourth = squares_[axis].rms();
  return mean_square > 0 ? fourth / std::sqrt(2.0 * count() * mean_square) : 0;
}

}  // namespace berth::table
