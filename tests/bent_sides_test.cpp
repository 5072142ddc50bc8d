// What a lens that bends a marker's sides does to corners from straight lines: told, and taken off.

#include "target/bent_sides.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "berth/detector.hpp"
#include "sim/render.hpp"

namespace berth {
namespace {

using Corners = std::array<std::array<double, 2>, 4>;

sim::Scene near_marker(double k1) {
  sim::Scene scene;
  scene.camera = paper_camera();
  scene.camera.distortion = {k1};
  scene.void_albedo = 0.88;
  scene.sensor.read_noise = 0.5;
  scene.markers.resize(1);
  scene.markers[0].size_m = 0.03;
  scene.markers[0].pose = translation(0.06, -0.04, 0.2);
  return scene;
}

Corners found_in(const sim::Scene& scene, const std::optional<CameraModel>& camera) {
  const GrayImage image = sim::render(scene);
  const auto backend = open_backend("simd");
  DetectorConfig config;
  config.camera = camera;
  config.marker_size_m = scene.markers[0].size_m;
  Detector detector(*backend, image.width(), image.height(), config);
  const FrameResult& result = detector.detect(image.view());
  EXPECT_EQ(result.detections.size(), 1u);
  return result.detections.empty() ? Corners{} : result.detections[0].corners;
}

double furthest(const Corners& a, const Corners& b) {
  double most = 0;
  for (std::size_t k = 0; k < 4; ++k) most = std::fmax(most, std::hypot(a[k][0] - b[k][0], a[k][1] - b[k][1]));
  return most;
}

TEST(BentSides, MoveTheDetectorsCornersAsTold) {
  for (const double k1 : {0.0, -0.35}) {
    const sim::Scene scene = near_marker(k1);
    const Corners truth = sim::truth(scene)[0].corners, found = found_in(scene, std::nullopt);
    Corners rays;
    for (std::size_t k = 0; k < 4; ++k) rays[k] = scene.camera.undistort(truth[k][0], truth[k][1]);
    const Corners shifts = bent_side_shift(scene.camera, rays);
    double most = 0;
    for (std::size_t k = 0; k < 4; ++k) {
      for (std::size_t axis = 0; axis < 2; ++axis) {
        EXPECT_NEAR(found[k][axis] - truth[k][axis], shifts[k][axis], 0.06) << k1 << ' ' << k;
        most = std::fmax(most, std::fabs(shifts[k][axis]));
      }
    }
    EXPECT_EQ(most > 0.2, k1 != 0);
    EXPECT_EQ(most < 1e-9, k1 == 0);
  }
}

TEST(BentSides, AreTakenOffWhereTheLensIsKnown) {
  const sim::Scene scene = near_marker(-0.35);
  const Corners truth = sim::truth(scene)[0].corners;
  EXPECT_GT(furthest(found_in(scene, std::nullopt), truth), 0.3);
  EXPECT_LT(furthest(found_in(scene, scene.camera), truth), 0.08);
}

// Moved as the detector would, and back.
TEST(BentSides, ComeBackFromWhereTheyWereMoved) {
  CameraModel fisheye = paper_camera();
  fisheye.lens = LensModel::equidistant;
  fisheye.distortion = {-0.01, 0.003, -0.002, 0.0004};
  for (const CameraModel& camera : {paper_camera(), fisheye}) {
    for (const double side : {20.0, 100.0, 200.0}) {
      for (const double x : {20.0, 240.0, 400.0}) {
        const Corners truth = {{{x, 60}, {x + 5, 60 + side}, {x + side + 10, 55 + side}, {x + side, 50}}};
        Corners rays;
        for (std::size_t k = 0; k < 4; ++k) rays[k] = camera.undistort(truth[k][0], truth[k][1]);
        const Corners shift = bent_side_shift(camera, rays);
        Corners corners = truth;
        for (std::size_t k = 0; k < 4; ++k) {
          for (std::size_t axis = 0; axis < 2; ++axis) corners[k][axis] += shift[k][axis];
        }
        straighten_corners(camera, corners);
        EXPECT_LT(furthest(corners, truth), 0.01) << side << ' ' << x;
      }
    }
  }
}

}  // namespace
}  // namespace berth
