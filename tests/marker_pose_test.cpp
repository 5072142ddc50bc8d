// Poses by least squares against poses whose corners are computed exactly, and their covariances against noise.

#include "target/marker_pose.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "berth/camera.hpp"
#include "sim/geometry.hpp"
#include "sim/random.hpp"
#include "support/noisy_corners.hpp"
#include "target/planar_pose.hpp"
#include "target/pose_steps.hpp"
#include "target/refine_pose.hpp"

namespace berth {
namespace {

constexpr double kSide_m = 0.08;

Pose pose_of(double rx, double ry, double rz, const Vec3& t) { return {sim::rotation(rx, ry, rz), t}; }

double between(sim::Random& random, double low, double high) { return random.uniform(low, high); }

/// In front of the camera and seen from its front, tilted by up to `tilt` about x and y.
Pose random_pose(sim::Random& random, double near_m, double far_m, double tilt) {
  const double z = between(random, near_m, far_m);
  const double rx = between(random, -tilt, tilt), ry = between(random, -tilt, tilt), rz = between(random, -3, 3);
  const double x = between(random, -0.25, 0.25) * z, y = between(random, -0.2, 0.2) * z;
  return pose_of(rx, ry, rz, {x, y, z});
}

bool shows_front(const Pose& pose) { return dot(column(pose.R, 2), pose.t) > 0.2 * length(pose.t); }

double difference(const Pose& a, const Pose& b) {
  double worst = 0;
  for (std::size_t i = 0; i < 9; ++i) worst = std::max(worst, std::fabs(a.R[i] - b.R[i]));
  for (std::size_t i = 0; i < 3; ++i) worst = std::max(worst, std::fabs(a.t[i] - b.t[i]));
  return worst;
}

/// Translation and rotation vector from `found` to `truth`, as the covariance has them.
std::array<double, 6> error_of(const Pose& found, const Pose& truth) {
  const Mat3 turn = product(truth.R, transposed(found.R));
  return {truth.t[0] - found.t[0],   truth.t[1] - found.t[1],   truth.t[2] - found.t[2],
          0.5 * (turn[7] - turn[5]), 0.5 * (turn[2] - turn[6]), 0.5 * (turn[3] - turn[1])};
}

TEST(PlanarPoses, HaveTheTruthAmongThem) {
  sim::Random random(1);
  const CameraModel camera = paper_camera();
  int poses = 0;
  while (poses < 5000) {
    const Pose truth = random_pose(random, 0.15, 2.5, 1.2);
    if (!shows_front(truth)) continue;
    ++poses;
    std::array<Pose, 2> found;
    const int count = planar_poses(camera, kSide_m, seen_corners(camera, truth, kSide_m), found);
    ASSERT_GE(count, 1) << poses;
    double nearest = difference(found[0], truth);
    if (count == 2) nearest = std::min(nearest, difference(found[1], truth));
    ASSERT_LT(nearest, 2e-5) << poses;  // square roots of differences near zero lose half of the digits
  }
}

// Near the saddle between both poses of a plane the refinement is slow.
TEST(MarkerPose, IsThereForSmallMarkersThatFaceTheCamera) {
  sim::Random random(3);
  const CameraModel camera = paper_camera();
  for (int i = 0; i < 5000; ++i) {
    const Pose truth = random_pose(random, 0.5, 2, 0.1);
    Pose found;
    PoseUncertainty uncertainty;
    ASSERT_TRUE(marker_pose(camera, kSide_m, 0.15, with_noise(seen_corners(camera, truth, kSide_m), 0.15, random),
                            found, uncertainty))
        << i;
  }
}

// As of edges: the ends of a side along rows or columns turn it together, px².
CornerCovariance edges_covariance() {
  CornerCovariance covariance{};
  const auto put = [&](std::size_t i, std::size_t j, double value) {
    covariance[8 * i + j] = covariance[8 * j + i] = value;
  };
  for (std::size_t corner = 0; corner < 4; ++corner) {
    put(2 * corner, 2 * corner, 4.2e-4);
    put(2 * corner + 1, 2 * corner + 1, 3.5e-4);
  }
  put(0, 2, -3.1e-4);
  put(4, 6, -3.1e-4);
  put(1, 7, -2.6e-4);
  put(3, 5, -2.6e-4);
  return covariance;
}

// A frame of a marker that faces the camera: steps that know the residuals' slopes alone go to and fro there, and had
// neither pose after 30 of them.
TEST(MarkerPose, ComesToItsEndWhereBothPosesBecomeOne) {
  const CameraModel camera = paper_camera();
  const Corners4 corners = {{{283.9032, 212.5668}, {283.8879, 262.6649}, {333.7474, 262.6528}, {333.7230, 212.5607}}};
  Pose pose;
  PoseUncertainty uncertainty;
  ASSERT_TRUE(marker_pose(camera, 1, corners, edges_covariance(), pose, uncertainty));
  // At its end: no step nearby is better.
  const SeenCorners seen = seen_corners_of(1, corners, edges_covariance());
  const auto squares = [&](const Pose& at) {
    PoseNormal normal;
    EXPECT_TRUE(add_corners(camera, at, seen, normal));
    return normal.squares;
  };
  for (std::size_t i = 0; i < 6; ++i) {
    for (const double size : {-1e-3, 1e-3}) {
      std::array<double, 6> step{};
      step[i] = size;
      EXPECT_GT(squares(moved(pose, step)), uncertainty.chi_square) << i;
    }
  }
}

// Slopes and bend are half the sum of squares' first and second derivative.
TEST(PoseSteps, KnowTheImagesBend) {
  CameraModel camera = paper_camera();
  camera.distortion = {};  // the lens is taken as linear
  sim::Random random(6);
  for (int trial = 0; trial < 50; ++trial) {
    const Pose truth = random_pose(random, 0.3, 1, 0.8);
    const SeenCorners seen =
        seen_corners_of(kSide_m, with_noise(seen_corners(camera, truth, kSide_m), 3, random), edges_covariance());
    const auto at = [&](const std::array<double, 6>& step) {
      PoseNormal normal;
      EXPECT_TRUE(add_corners(camera, moved(truth, step), seen, normal));
      return normal;
    };
    const PoseNormal here = at({});
    for (std::size_t i = 0; i < 6; ++i) {
      constexpr double kSize = 1e-5;
      for (std::size_t j = 0; j <= i; ++j) {
        const auto squares = [&](double by_i, double by_j) {
          std::array<double, 6> step{};
          step[i] += by_i * kSize;
          step[j] += by_j * kSize;
          return at(step).squares;
        };
        const double second =
            (squares(1, 1) - squares(1, -1) - squares(-1, 1) + squares(-1, -1)) / (4 * kSize * kSize) / 2;
        const double scale = std::sqrt(here.matrix[i * 7] * here.matrix[j * 7]);
        EXPECT_NEAR(here.matrix[i * 6 + j] + here.bend[i * 6 + j], second, 1e-3 * scale) << trial << ' ' << i << j;
      }
    }
    double bend = 0;
    for (std::size_t i = 0; i < 6; ++i) bend = std::max(bend, std::fabs(here.bend[i * 7]) / here.matrix[i * 7]);
    EXPECT_GT(bend, 0.01) << trial;
  }
}

TEST(MarkerPose, RecoversPosesOfAllKinds) {
  sim::Random random(2);
  const CameraModel camera = paper_camera();
  int poses = 0;
  while (poses < 5000) {
    const Pose truth = random_pose(random, 0.15, 2.5, 1.2);
    if (!shows_front(truth)) continue;
    ++poses;
    Pose pose;
    PoseUncertainty uncertainty;
    ASSERT_TRUE(marker_pose(camera, kSide_m, 0.1, seen_corners(camera, truth, kSide_m), pose, uncertainty)) << poses;
    ASSERT_LT(difference(pose, truth), 1e-7) << poses;
    ASSERT_LT(uncertainty.error_px, 1e-6) << poses;
  }
}

// Normalised estimation error squared: chi-square with six degrees of freedom, mean 6, its 95 % quantile 12.59.
TEST(MarkerPose, ItsCovarianceIsThatOfItsErrors) {
  sim::Random random(3);
  const CameraModel camera = paper_camera();
  constexpr int kFrames = 10000;
  constexpr double kDeviation_px = 0.1;
  double sum = 0;
  int outside = 0, frames = 0;
  std::array<double, 6> axis{};
  while (frames < kFrames) {
    // Near and tilted enough for the other pose of the plane to be out of question.
    const Pose truth = random_pose(random, 0.15, 0.5, 0.9);
    const double facing = dot(column(truth.R, 2), truth.t) / length(truth.t);
    if (facing < 0.4 || facing > 0.94) continue;
    ++frames;
    Pose pose;
    PoseUncertainty uncertainty;
    const Corners4 corners = with_noise(seen_corners(camera, truth, kSide_m), kDeviation_px, random);
    ASSERT_TRUE(marker_pose(camera, kSide_m, kDeviation_px, corners, pose, uncertainty));
    const std::array<double, 6> error = error_of(pose, truth);
    const double nees = mahalanobis(uncertainty.covariance, error);
    sum += nees;
    outside += nees > 12.592 ? 1 : 0;
    for (std::size_t i = 0; i < 6; ++i) axis[i] += error[i] * error[i] / uncertainty.covariance[i * 7];
  }
  // Bounds of 95 %: the mean of N has a variance of 12 / N, an axis' of 2 / N, a share's of p (1 - p) / N.
  EXPECT_NEAR(sum / kFrames, 6, 1.96 * std::sqrt(12.0 / kFrames));
  EXPECT_NEAR(static_cast<double>(outside) / kFrames, 0.05, 1.96 * std::sqrt(0.05 * 0.95 / kFrames));
  for (std::size_t i = 0; i < 6; ++i) EXPECT_NEAR(axis[i] / kFrames, 1, 2.64 * std::sqrt(2.0 / kFrames)) << i;
}

TEST(MarkerPose, SaysWhenTheCornersDoNotTellWhichPoseItIs) {
  sim::Random random(4);
  const CameraModel camera = paper_camera();
  Pose pose;
  PoseUncertainty uncertainty;
  const Pose far = pose_of(0.15, 0.1, 0.4, {0.1, 0, 2});
  ASSERT_TRUE(marker_pose(camera, kSide_m, 0.1, with_noise(seen_corners(camera, far, kSide_m), 0.1, random), pose,
                          uncertainty));
  EXPECT_TRUE(uncertainty.has_other);
  EXPECT_GT(uncertainty.ambiguity(), 0.5);
  const Pose near = pose_of(0.7, 0.1, 0.4, {0.02, 0, 0.25});
  ASSERT_TRUE(marker_pose(camera, kSide_m, 0.1, with_noise(seen_corners(camera, near, kSide_m), 0.1, random), pose,
                          uncertainty));
  EXPECT_LT(uncertainty.ambiguity(), 0.1);
  EXPECT_LT(difference(pose, near), 0.01);
}

// Corners whose errors go together and are not equally large: what they are off in pixels may speak for the wrong pose.
TEST(MarkerPose, ChoosesByWhatTheCornersKnow) {
  sim::Random random(12);
  const CameraModel camera = paper_camera();
  int doubles = 0, wrong = 0, wrong_by_pixels = 0;
  for (int i = 0; i < 2000; ++i) {
    const Pose truth = random_pose(random, 0.3, 0.8, 0.3);
    Corners4 corners = seen_corners(camera, truth, kSide_m);
    CornerCovariance covariance{};
    for (int k = 0; k < 8; ++k) {
      const double size_px = k < 4 ? 0.2 : 0.02, by = normal(random);
      std::array<double, 8> error;
      for (double& value : error) value = size_px * normal(random);
      for (std::size_t j = 0; j < 64; ++j) covariance[j] += error[j / 8] * error[j % 8];
      for (std::size_t j = 0; j < 8; ++j) corners[j / 2][j % 2] += by * error[j];
    }
    Pose pose;
    PoseUncertainty uncertainty;
    if (!marker_pose(camera, kSide_m, corners, covariance, pose, uncertainty) || !uncertainty.has_other) continue;
    ++doubles;
    ASSERT_GE(uncertainty.other_excess, 0);
    ASSERT_LE(uncertainty.ambiguity(), 1);
    const bool is_wrong = difference(uncertainty.other, truth) < difference(pose, truth);
    wrong += is_wrong ? 1 : 0;
    wrong_by_pixels += is_wrong == (uncertainty.error_px <= uncertainty.other_error_px) ? 1 : 0;
  }
  EXPECT_GT(doubles, 500);
  EXPECT_GT(wrong, 0);
  EXPECT_LT(wrong, wrong_by_pixels);
}

TEST(MarkerPose, ScalesWithTheMarker) {
  sim::Random random(6);
  const CameraModel camera = paper_camera();
  const Corners4 corners = with_noise(seen_corners(camera, pose_of(0.5, 0.1, 0.4, {0.1, 0, 1}), kSide_m), 0.1, random);
  Detection small;
  Detection large;
  ASSERT_TRUE(marker_pose(camera, kSide_m, 0.1, corners, small.pose, small.pose_uncertainty.emplace()));
  ASSERT_TRUE(marker_pose(camera, 3 * kSide_m, 0.1, corners, large.pose, large.pose_uncertainty.emplace()));
  scale_pose(3, small);
  EXPECT_LT(difference(small.pose, large.pose), 1e-7);
  ASSERT_TRUE(large.pose_uncertainty->has_other);
  EXPECT_LT(difference(small.pose_uncertainty->other, large.pose_uncertainty->other), 1e-6);
  for (std::size_t i = 0; i < 36; ++i) {
    const double expected = large.pose_uncertainty->covariance[i];
    const double scale =
        std::sqrt(large.pose_uncertainty->covariance[i / 6 * 7] * large.pose_uncertainty->covariance[i % 6 * 7]);
    EXPECT_NEAR(small.pose_uncertainty->covariance[i], expected, 1e-5 * scale) << i;
  }
  Detection without;
  without.pose.t = {1, 2, 3};
  scale_pose(2, without);
  EXPECT_EQ(without.pose.t[2], 6);
}

TEST(MarkerPose, RefusesWhatIsNoMarker) {
  const CameraModel camera = paper_camera();
  Pose pose;
  PoseUncertainty uncertainty;
  const auto refused = [&](double size_m, const Corners4& corners) {
    return !marker_pose(camera, size_m, 0.1, corners, pose, uncertainty);
  };
  const Corners4 square = {{{100, 100}, {100, 200}, {200, 200}, {200, 100}}};
  ASSERT_FALSE(refused(0.1, square));
  EXPECT_TRUE(refused(0, square));
  EXPECT_TRUE(refused(-1, square));
  EXPECT_TRUE(refused(std::numeric_limits<double>::quiet_NaN(), square));
  EXPECT_TRUE(refused(0.1, {{{100, 100}, {200, 100}, {200, 200}, {100, 200}}}));  // clockwise
  EXPECT_TRUE(refused(0.1, {{{100, 100}, {100, 100}, {100, 100}, {100, 100}}}));
  EXPECT_TRUE(refused(0.1, {{{100, 100}, {110, 110}, {120, 120}, {130, 130}}}));
  EXPECT_TRUE(refused(0.1, {{{100, 100}, {200, 200}, {100, 200}, {200, 100}}}));
  Corners4 broken = square;
  broken[2][1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_TRUE(refused(0.1, broken));
}

TEST(RefinePose, WeighsCornersByTheirCovariance) {
  sim::Random random(5);
  const CameraModel camera = paper_camera();
  const Pose truth = pose_of(0.4, -0.3, 0.2, {0.01, 0.02, 0.4});
  std::vector<PoseCorner> corners;
  for (int i = 0; i < 12; ++i) {
    const Vec3 point = {between(random, -0.05, 0.05), between(random, -0.05, 0.05), between(random, -0.02, 0.02)};
    const Vec3 at = transform(truth, point);
    corners.push_back({point, camera.project(at[0] / at[2], at[1] / at[2]), {0.01, 0, 0.01}});
  }
  // A corner that is far off along a line, and says so, does no harm.
  corners[3].seen_px[0] += 8;
  corners[3].seen_px[1] += 8;
  corners[3].covariance_px2 = {1e8, 0.99999999e8, 1e8};
  RefinedPose refined;
  const Pose start = pose_of(0.3, -0.2, 0.3, {0, 0, 0.5});
  ASSERT_TRUE(refine_pose(camera, corners.data(), corners.size(), start, refined));
  EXPECT_LT(difference(refined.pose, truth), 1e-6);
  EXPECT_LT(refined.chi_square, 1e-3);
  // Across that line it is far off in its own measure: (8, -8) is 8 sqrt(2) px at a deviation of 1 px.
  corners[3].seen_px[1] -= 16;
  ASSERT_TRUE(refine_pose(camera, corners.data(), corners.size(), start, refined));
  EXPECT_NEAR(refined.chi_square, 128, 10);
  EXPECT_FALSE(refine_pose(camera, corners.data(), 2, start, refined));
  EXPECT_FALSE(refine_pose(camera, corners.data(), corners.size(), pose_of(0, 0, 0, {0, 0, -1}), refined));
}

}  // namespace
}  // namespace berth
