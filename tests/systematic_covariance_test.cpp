// Poses by a camera and a marker size that are not the true ones, against what was said of them.

#include "berth/systematic_covariance.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "sim/geometry.hpp"
#include "support/noisy_corners.hpp"
#include "target/marker_pose.hpp"

namespace berth {
namespace {

constexpr double kSide_m = 0.08;

CalibrationDeviation deviation() {
  CalibrationDeviation deviation;
  deviation.fx = 1.5;
  deviation.fy = 2;
  deviation.cx = 2;
  deviation.cy = 1;
  deviation.distortion = {0.01, 0.03, 0.0005, 0.0004};
  deviation.marker_size_m = 0.0002;
  return deviation;
}

Detection marker_at(const Corners4& corners) {
  Detection marker;
  marker.corners = corners;
  marker.has_pose = marker_pose(paper_camera(), kSide_m, 0.1, corners, marker.pose, marker.pose_uncertainty.emplace());
  return marker;
}

TEST(SystematicCovariance, IsThatOfPosesByAWrongCalibration) {
  const CameraModel used = paper_camera();
  const CalibrationDeviation off = deviation();
  const Pose truth = {sim::rotation(0.5, -0.3, 0.2), {0.08, -0.05, 0.4}};
  std::array<double, 36> covariance{};
  ASSERT_TRUE(systematic_covariance(used, kSide_m, marker_at(seen_corners(used, truth, kSide_m)), off, covariance));
  sim::Random random(1);
  constexpr int kDraws = 4000;
  std::array<double, 6> squares{};
  double across = 0;
  for (int n = 0; n < kDraws; ++n) {
    CameraModel camera = used;
    camera.fx += off.fx * normal(random);
    camera.fy += off.fy * normal(random);
    camera.cx += off.cx * normal(random);
    camera.cy += off.cy * normal(random);
    for (std::size_t i = 0; i < 4; ++i) camera.distortion[i] += off.distortion[i] * normal(random);
    const double size_m = kSide_m + off.marker_size_m * normal(random);
    const Detection marker = marker_at(seen_corners(camera, truth, size_m));
    ASSERT_TRUE(marker.has_pose);
    const auto error = step_between(marker.pose, truth);
    for (std::size_t i = 0; i < 6; ++i) squares[i] += error[i] * error[i] / kDraws;
    across += error[0] * error[2] / kDraws;
  }
  // The variance of 4,000 draws is within 6 % of its own in 99 % of cases; the rest is for what is not linear.
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(squares[i] / covariance[7 * i], 1, 0.08) << i;
  EXPECT_NEAR(across / std::sqrt(squares[0] * squares[2]), covariance[2] / std::sqrt(covariance[0] * covariance[14]),
              0.05);
}

TEST(SystematicCovariance, OfASizeIsARangeInProportion) {
  const CameraModel camera = paper_camera();
  const Pose truth = {sim::rotation(0.5, -0.3, 0.2), {0.1, -0.2, 0.8}};
  CalibrationDeviation off;
  off.marker_size_m = 0.01 * kSide_m;
  std::array<double, 36> covariance{};
  ASSERT_TRUE(systematic_covariance(camera, kSide_m, marker_at(seen_corners(camera, truth, kSide_m)), off, covariance));
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(std::sqrt(covariance[7 * i]), 0.01 * std::fabs(truth.t[i]), 1e-4);
  for (std::size_t i = 3; i < 6; ++i) EXPECT_LT(std::sqrt(covariance[7 * i]), 1e-4);
}

TEST(SystematicCovariance, IsNoneOfAnExactCalibration) {
  const CameraModel camera = paper_camera();
  const Detection marker = marker_at(seen_corners(camera, {sim::rotation(0.5, 0, 0), {0, 0, 0.5}}, kSide_m));
  std::array<double, 36> covariance{};
  covariance.fill(1);
  ASSERT_TRUE(systematic_covariance(camera, kSide_m, marker, {}, covariance));
  for (const double value : covariance) EXPECT_LT(std::fabs(value), 1e-20);
  covariance.fill(1);
  EXPECT_FALSE(systematic_covariance(camera, kSide_m, Detection{}, {}, covariance));
  EXPECT_EQ(covariance[0], 1);
}

}  // namespace
}  // namespace berth
