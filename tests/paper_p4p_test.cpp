// paper_p4p against poses whose corners are computed exactly.

#include "target/paper_p4p.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <random>

namespace berth {
namespace {

using Corners4 = std::array<std::array<double, 2>, 4>;

// Marker frame to camera frame: turned about the camera's axes by rx, then ry, then rz (radians).
Pose pose_of(double rx, double ry, double rz, double tx, double ty, double tz) {
  const double cx = std::cos(rx), sx = std::sin(rx), cy = std::cos(ry), sy = std::sin(ry), cz = std::cos(rz),
               sz = std::sin(rz);
  Pose pose;
  pose.R = {cz * cy,
            cz * sy * sx - sz * cx,
            cz * sy * cx + sz * sx,
            sz * cy,
            sz * sy * sx + cz * cx,
            sz * sy * cx - cz * sx,
            -sy,
            cy * sx,
            cy * cx};
  pose.t = {tx, ty, tz};
  return pose;
}

// Image of the marker's corners in the paper's order: upper left, lower left, lower right, upper right. Returns false
// when the marker shows its back.
bool corners_of(const CameraModel& camera, const Pose& pose, double size, Corners4& corners) {
  const double h = size / 2;
  const double place[4][2] = {{-h, -h}, {-h, h}, {h, h}, {h, -h}};
  for (std::size_t i = 0; i < 4; ++i) {
    double p[3];
    for (std::size_t r = 0; r < 3; ++r) {
      p[r] = pose.R[3 * r] * place[i][0] + pose.R[3 * r + 1] * place[i][1] + pose.t[r];
    }
    if (p[2] <= 0) return false;
    corners[i] = camera.project(p[0] / p[2], p[1] / p[2]);
  }
  // The z axis points into the marker: away from the viewer on the front.
  return pose.R[2] * pose.t[0] + pose.R[5] * pose.t[1] + pose.R[8] * pose.t[2] > 0;
}

double largest_difference(const Pose& a, const Pose& b) {
  double worst = 0;
  for (std::size_t i = 0; i < 9; ++i) worst = std::max(worst, std::fabs(a.R[i] - b.R[i]));
  for (std::size_t i = 0; i < 3; ++i) worst = std::max(worst, std::fabs(a.t[i] - b.t[i]));
  return worst;
}

TEST(PaperP4p, SeesAFrontalMarkerWithoutRotation) {
  const CameraModel camera = paper_camera();
  const Pose truth = pose_of(0, 0, 0, 0, 0, 0.75);
  Corners4 corners;
  ASSERT_TRUE(corners_of(camera, truth, 0.08, corners));
  EXPECT_LT(corners[0][0], corners[3][0]);  // upper left is left of upper right
  EXPECT_LT(corners[0][1], corners[1][1]);  // and above lower left
  Pose pose;
  ASSERT_TRUE(paper_p4p(camera, 0.08, corners, pose));
  EXPECT_LT(largest_difference(pose, truth), 1e-9);
}

TEST(PaperP4p, RecoversPosesOfAllKinds) {
  std::mt19937 random(20);
  const auto between = [&](double a, double b) { return a + (b - a) * (static_cast<double>(random()) / 4294967296.0); };
  const CameraModel camera = paper_camera();
  int poses = 0;
  double worst = 0;
  while (poses < 5000) {
    const double z = between(0.15, 2.5);
    const Pose truth = pose_of(between(-1.2, 1.2), between(-1.2, 1.2), between(-3.14, 3.14), between(-0.3, 0.3) * z,
                               between(-0.2, 0.2) * z, z);
    Corners4 corners;
    if (!corners_of(camera, truth, 0.08, corners)) continue;
    ++poses;
    Pose pose;
    ASSERT_TRUE(paper_p4p(camera, 0.08, corners, pose)) << "pose " << poses;
    worst = std::max(worst, largest_difference(pose, truth));
  }
  EXPECT_LT(worst, 1e-6);
}

TEST(PaperP4p, GivesARotationWhateverTheNoise) {
  std::mt19937 random(21);
  const auto noise = [&] { return (static_cast<double>(random()) / 4294967296.0 - 0.5) * 2; };
  const CameraModel camera = paper_camera();
  const Pose truth = pose_of(0.5, -0.4, 1, 0.05, 0.02, 0.6);
  Corners4 corners;
  ASSERT_TRUE(corners_of(camera, truth, 0.08, corners));
  for (int trial = 0; trial < 1000; ++trial) {
    Corners4 noisy = corners;
    for (auto& c : noisy) {
      c[0] += noise();
      c[1] += noise();
    }
    Pose pose;
    ASSERT_TRUE(paper_p4p(camera, 0.08, noisy, pose));
    for (std::size_t i = 0; i < 3; ++i) {
      for (std::size_t j = 0; j < 3; ++j) {
        double product = 0;
        for (std::size_t k = 0; k < 3; ++k) product += pose.R[3 * k + i] * pose.R[3 * k + j];
        EXPECT_NEAR(product, i == j ? 1 : 0, 1e-12);
      }
    }
    const auto& r = pose.R;
    const double det =
        r[0] * (r[4] * r[8] - r[5] * r[7]) - r[1] * (r[3] * r[8] - r[5] * r[6]) + r[2] * (r[3] * r[7] - r[4] * r[6]);
    EXPECT_NEAR(det, 1, 1e-12);
    EXPECT_NEAR(pose.t[2], truth.t[2], 0.1);
  }
}

TEST(PaperP4p, ScalesWithTheMarker) {
  const CameraModel camera = paper_camera();
  Corners4 corners;
  ASSERT_TRUE(corners_of(camera, pose_of(0.3, 0.2, 0.1, 0, 0, 1), 0.1, corners));
  Pose one, two;
  ASSERT_TRUE(paper_p4p(camera, 0.1, corners, one));
  ASSERT_TRUE(paper_p4p(camera, 0.2, corners, two));
  for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(two.t[i], 2 * one.t[i], 1e-9);
}

TEST(PaperP4p, RefusesWhatIsNoMarker) {
  const CameraModel camera = paper_camera();
  Pose pose;
  const Corners4 square = {{{100, 100}, {100, 200}, {200, 200}, {200, 100}}};
  ASSERT_TRUE(paper_p4p(camera, 0.1, square, pose));
  EXPECT_FALSE(paper_p4p(camera, 0, square, pose));
  EXPECT_FALSE(paper_p4p(camera, -1, square, pose));
  EXPECT_FALSE(paper_p4p(camera, std::numeric_limits<double>::quiet_NaN(), square, pose));
  EXPECT_FALSE(paper_p4p(camera, std::numeric_limits<double>::infinity(), square, pose));
  const Corners4 clockwise = {{{100, 100}, {200, 100}, {200, 200}, {100, 200}}};
  EXPECT_FALSE(paper_p4p(camera, 0.1, clockwise, pose));
  const Corners4 point = {{{100, 100}, {100, 100}, {100, 100}, {100, 100}}};
  EXPECT_FALSE(paper_p4p(camera, 0.1, point, pose));
  const Corners4 line = {{{100, 100}, {110, 110}, {120, 120}, {130, 130}}};
  EXPECT_FALSE(paper_p4p(camera, 0.1, line, pose));
  const Corners4 crossed = {{{100, 100}, {200, 200}, {100, 200}, {200, 100}}};
  EXPECT_FALSE(paper_p4p(camera, 0.1, crossed, pose));
  Corners4 broken = square;
  broken[2][1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_FALSE(paper_p4p(camera, 0.1, broken, pose));
}

}  // namespace
}  // namespace berth
