// refine_pose against Ceres: another optimiser, another parametrisation (angle and axis) and derivatives by
// differences, so that neither the steps nor the slopes nor the whitening are shared.
#include <ceres/ceres.h>
#include <ceres/rotation.h>
#include <gtest/gtest.h>

#include <cmath>

#include "berth/camera.hpp"
#include "pose_algebra.hpp"
#include "sim/geometry.hpp"
#include "support/marker_scene.hpp"
#include "target/refine_pose.hpp"

namespace berth {
namespace {

using Mat2 = Eigen::Matrix2d;

CameraModel fisheye_camera() {
  CameraModel camera = paper_camera();
  camera.lens = LensModel::equidistant;
  camera.distortion = {-0.03, 0.012, -0.006, 0.001};
  return camera;
}

/// One corner's residual, whitened by the symmetric root of the covariance's inverse.
struct CornerCost {
  CameraModel camera;
  PoseCorner corner;

  bool operator()(const double* turn, const double* shift, double* error) const {
    double at[3];
    ceres::AngleAxisRotatePoint(turn, corner.point_m.data(), at);
    for (int i = 0; i < 3; ++i) at[i] += shift[i];
    const auto image = camera.project(at[0] / at[2], at[1] / at[2]);
    const auto& [xx, xy, yy] = corner.covariance_px2;
    const Mat2 covariance = (Mat2() << xx, xy, xy, yy).finished();
    const Eigen::Vector2d off(corner.seen_px[0] - image[0], corner.seen_px[1] - image[1]);
    const Eigen::Vector2d white = Eigen::SelfAdjointEigenSolver<Mat2>(covariance).operatorInverseSqrt() * off;
    error[0] = white[0];
    error[1] = white[1];
    return true;
  }
};

struct Optimum {
  Pose pose;
  double chi_square = 0;
  /// Translation, then a turn about the camera's axes.
  Eigen::Matrix<double, 6, 6> covariance;
};

Optimum optimum_by_ceres(const CameraModel& camera, const std::vector<PoseCorner>& corners, const Pose& start) {
  // Ceres keeps rotations by columns.
  const Mat3 columns = transposed(start.R);
  double turn[3], shift[3] = {start.t[0], start.t[1], start.t[2]};
  ceres::RotationMatrixToAngleAxis(columns.data(), turn);
  ceres::Problem problem;
  for (const PoseCorner& corner : corners) {
    problem.AddResidualBlock(
        new ceres::NumericDiffCostFunction<CornerCost, ceres::CENTRAL, 2, 3, 3>(new CornerCost{camera, corner}),
        nullptr, turn, shift);
  }
  ceres::Solver::Options options;
  options.max_num_iterations = 200;
  options.function_tolerance = 1e-16;
  options.parameter_tolerance = 1e-14;
  options.gradient_tolerance = 1e-16;
  options.logging_type = ceres::SILENT;
  ceres::Solver::Summary summary;
  ceres::Solve(options, &problem, &summary);
  EXPECT_TRUE(summary.IsSolutionUsable()) << summary.BriefReport();

  Optimum optimum;
  optimum.chi_square = 2 * summary.final_cost;
  Mat3 rotation{};
  ceres::AngleAxisToRotationMatrix(turn, rotation.data());
  optimum.pose.R = transposed(rotation);
  optimum.pose.t = {shift[0], shift[1], shift[2]};
  ceres::Covariance covariance({});
  EXPECT_TRUE(covariance.Compute({{turn, turn}, {turn, shift}, {shift, shift}}, &problem));
  Eigen::Matrix<double, 3, 3, Eigen::RowMajor> tt, ts, ss;
  covariance.GetCovarianceBlock(turn, turn, tt.data());
  covariance.GetCovarianceBlock(turn, shift, ts.data());
  covariance.GetCovarianceBlock(shift, shift, ss.data());
  // From a change of the angle-axis vector a to a turn on the camera's side: SO(3)'s left Jacobian,
  // 1 + (1 - cos |a|) / |a|^2 [a]x + (|a| - sin |a|) / |a|^3 [a]x^2.
  const Eigen::Vector3d a(turn[0], turn[1], turn[2]);
  const double angle = a.norm();
  Eigen::Matrix3d hat;
  hat << 0, -a[2], a[1], a[2], 0, -a[0], -a[1], a[0], 0;
  const Eigen::Matrix3d left = Eigen::Matrix3d::Identity() + (1 - std::cos(angle)) / (angle * angle) * hat +
                               (angle - std::sin(angle)) / (angle * angle * angle) * hat * hat;
  optimum.covariance.topLeftCorner<3, 3>() = ss;
  optimum.covariance.bottomLeftCorner<3, 3>() = left * ts;
  optimum.covariance.topRightCorner<3, 3>() = (left * ts).transpose();
  optimum.covariance.bottomRightCorner<3, 3>() = left * tt * left.transpose();
  return optimum;
}

TEST(RefinePose, EndsWhereCeresDoesAndKnowsAsMuch) {
  Random random(12);
  for (const CameraModel& camera : {paper_camera(), fisheye_camera()}) {
    for (int trial = 0; trial < 20; ++trial) {
      Pose truth = translation(random.between(-0.08, 0.08), random.between(-0.06, 0.06), random.between(0.3, 0.6));
      truth.R = sim::rotation(random.between(0.2, 0.7), random.between(-0.7, 0.7), random.between(-2, 2));
      std::vector<PoseCorner> corners;
      for (const Vec3& place : corner_places(0.1)) {
        PoseCorner corner;
        corner.point_m = place;
        const Vec2 image = image_of(camera, transform(truth, place));
        corner.seen_px = {image[0] + 0.3 * random.normal(), image[1] + 0.3 * random.normal()};
        const double xx = random.between(0.02, 0.2), yy = random.between(0.02, 0.2);
        corner.covariance_px2 = {xx, random.between(-0.8, 0.8) * std::sqrt(xx * yy), yy};
        corners.push_back(corner);
      }
      RefinedPose refined;
      ASSERT_TRUE(refine_pose(camera, corners.data(), corners.size(), truth, refined)) << trial;
      const Optimum optimum = optimum_by_ceres(camera, corners, truth);
      EXPECT_NEAR(refined.chi_square, optimum.chi_square, 1e-7 * (1 + optimum.chi_square)) << trial;
      const std::array<double, 6> apart = step_between(optimum.pose, refined.pose);
      for (int i = 0; i < 6; ++i) {
        const double deviation = std::sqrt(optimum.covariance(i, i));
        // Steps end where the next would lower the squares by 1e-9: some 3e-5 deviations before the optimum.
        EXPECT_LT(std::fabs(apart[static_cast<std::size_t>(i)]), 1e-3 * deviation) << trial << " axis " << i;
        for (int j = 0; j < 6; ++j) {
          const double scale = deviation * std::sqrt(optimum.covariance(j, j));
          EXPECT_NEAR(refined.covariance[static_cast<std::size_t>(6 * i + j)], optimum.covariance(i, j), 1e-3 * scale)
              << trial << " at " << i << ", " << j;
        }
      }
    }
  }
}

}  // namespace
}  // namespace berth
