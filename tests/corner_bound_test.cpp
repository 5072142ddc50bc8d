// The bounds of corners and poses against Fisher's information of rendered images, and against counting.
#include "table/corner_bound.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <vector>

#include "sim/close_up.hpp"
#include "sim/paint.hpp"
#include "sim/printed_marker.hpp"
#include "sim/render.hpp"
#include "sim/sensor.hpp"
#include "target/symmetric.hpp"

namespace berth {
namespace {

using Image = std::vector<double>;
constexpr int kFine = 4;

/// The radiance that every pixel collects: rendered as sim::Renderer does, without noise and rounding.
Image radiance_of(const sim::Scene& scene) {
  CameraModel fine = scene.camera;
  fine.width *= kFine;
  fine.height *= kFine;
  fine.fx *= kFine;
  fine.fy *= kFine;
  fine.cx = (fine.cx + 0.5) * kFine - 0.5;
  fine.cy = (fine.cy + 0.5) * kFine - 0.5;
  Image image = sim::paint(scene, sim::marker_surfaces(scene.markers[0]), sim::RayMap(fine));
  sim::gaussian_blur(image, fine.width, fine.height, kFine * scene.sensor.blur_sigma_px);
  Image result;
  for (int y = 0; y < scene.camera.height; ++y) {
    for (int x = 0; x < scene.camera.width; ++x) {
      double sum = 0;
      for (int i = 0; i < kFine * kFine; ++i) {
        const int at = (y * kFine + i / kFine) * fine.width + x * kFine + i % kFine;
        sum += image[static_cast<std::size_t>(at)];
      }
      result.push_back(sum / (kFine * kFine));
    }
  }
  return result;
}

/// Bounds of the pose's axes: derivatives of rendered images by what an estimator does not know.
table::SixAxes bound_by_images(const sim::Scene& scene) {
  constexpr std::size_t kUnknowns = 13;  // the pose's six, the blur, dark and contrast as planes
  constexpr double kStep_px = 0.1;
  const sim::SceneMarker& marker = scene.markers[0];
  const sim::Sensor& sensor = scene.sensor;
  const double range_m = length(marker.pose.t), per_px = range_m / scene.camera.fx;
  std::vector<Image> slopes;
  const auto add_slope = [&](double step, const auto& change) {
    sim::Scene before = scene, after = scene;
    change(before, -step);
    change(after, step);
    const Image a = radiance_of(before), b = radiance_of(after);
    Image slope;
    for (std::size_t i = 0; i < a.size(); ++i) slope.push_back((b[i] - a[i]) / (2 * step));
    slopes.push_back(slope);
  };
  for (std::size_t axis = 0; axis < 2; ++axis) {
    add_slope(kStep_px * per_px, [axis](sim::Scene& s, double by) { s.markers[0].pose.t[axis] += by; });
  }
  // Away along the ray, which leaves it where it is in the image; from that, along z.
  const Vec3 ray_to = scaled(marker.pose.t, 1 / marker.pose.t[2]);
  add_slope(kStep_px * per_px * 2 * range_m / marker.size_m,
            [ray_to](sim::Scene& s, double by) { s.markers[0].pose.t = add(s.markers[0].pose.t, scaled(ray_to, by)); });
  for (std::size_t i = 0; i < slopes[2].size(); ++i) {
    slopes[2][i] -= ray_to[0] * slopes[0][i] + ray_to[1] * slopes[1][i];
  }
  for (std::size_t axis = 0; axis < 3; ++axis) {
    add_slope(kStep_px * per_px * 2 / marker.size_m, [axis](sim::Scene& s, double by) {
      Vec3 turn = {0, 0, 0};
      turn[axis] = by;
      s.markers[0].pose.R = product(sim::rotation(turn[0], turn[1], turn[2]), s.markers[0].pose.R);
    });
  }
  add_slope(0.1, [](sim::Scene& s, double by) { s.sensor.blur_sigma_px += by; });

  const Image image = radiance_of(scene);
  const MarkerFamily& shape = family(marker.family);
  const double half_m = marker.size_m * shape.total_width / shape.border_width / 2;
  const double range = sensor.white_level - sensor.black_level;
  SquareMatrix<kUnknowns> information{};
  for (int y = 0; y < scene.camera.height; ++y) {
    for (int x = 0; x < scene.camera.width; ++x) {
      const auto i = static_cast<std::size_t>(y * scene.camera.width + x);
      // Where the pixel's ray meets the marker's plane.
      const Vec2 point = scene.camera.undistort(x, y);
      const Vec3 ray = {point[0], point[1], 1}, normal = column(marker.pose.R, 2);
      const Vec3 at = transform(inverse(marker.pose), scaled(ray, dot(normal, marker.pose.t) / dot(normal, ray)));
      if (std::fabs(at[0]) > half_m || std::fabs(at[1]) > half_m) continue;
      std::array<double, kUnknowns> row{};
      for (std::size_t k = 0; k < 7; ++k) row[k] = range * slopes[k][i];
      const double tones[3] = {1, at[0] / half_m, at[1] / half_m};
      for (std::size_t k = 0; k < 3; ++k) {
        row[7 + k] = tones[k];
        row[10 + k] = tones[k] * image[i];
      }
      const double shot = sensor.full_well_e > 0 ? 255 / sensor.full_well_e : 0;
      const double variance = sensor.read_noise * sensor.read_noise + 1 / 12.0 + shot * range * image[i];
      for (std::size_t j = 0; j < kUnknowns * kUnknowns; ++j) {
        information[j] += row[j / kUnknowns] * row[j % kUnknowns] / variance;
      }
    }
  }
  SquareMatrix<kUnknowns> covariance{};
  EXPECT_TRUE(invert<kUnknowns>(information, covariance));
  table::SixAxes bound;
  for (std::size_t i = 0; i < 6; ++i) bound[i] = std::sqrt(covariance[i * kUnknowns + i]);
  return bound;
}

TEST(CornerBound, IsThatOfRenderedImages) {
  for (const sim::CloseUp& what : {sim::CloseUp{30, 2, 50}, sim::CloseUp{45, 2, 20}}) {
    sim::Scene scene = sim::close_up_scene(paper_camera(), what, 7);
    scene.sensor.vignetting = 0;
    scene.sensor.full_well_e = 20000;
    const TruthMarker truth = sim::truth(scene).front();
    const auto bound = table::pose_bound(scene.camera, truth, table::corner_information(scene));
    ASSERT_TRUE(bound);
    const table::SixAxes expected = bound_by_images(scene);
    for (std::size_t i = 0; i < 6; ++i) {
      EXPECT_NEAR((*bound)[i] / expected[i], 1, 0.02) << what.side_px << " px, axis " << i;
    }
  }
}

// The images that bound is of are those that the simulator renders.
TEST(CornerBound, IsOfTheSimulatorsImages) {
  sim::Scene scene = sim::close_up_scene(paper_camera(), {30, 2, 50}, 7);
  scene.sensor.vignetting = scene.sensor.read_noise = scene.sensor.full_well_e = 0;
  const Image image = radiance_of(scene);
  const GrayImage rendered = sim::Renderer(scene.camera, kFine).render(scene);
  const double range = scene.sensor.white_level - scene.sensor.black_level;
  for (int y = 0; y < scene.camera.height; ++y) {
    for (int x = 0; x < scene.camera.width; ++x) {
      const double grey =
          scene.sensor.black_level + range * image[static_cast<std::size_t>(y * scene.camera.width + x)];
      ASSERT_NEAR(rendered.view().row(y)[x], grey, 0.5 + 0.2) << x << ", " << y;
    }
  }
}

TEST(CornerBound, GoesWithTheNoise) {
  sim::Scene scene = sim::close_up_scene(paper_camera(), {40, 2}, 1);
  const auto bound_with = [&](double noise) {
    scene.sensor.read_noise = std::sqrt(noise * noise - 1 / 12.0);  // the rounding's own
    return table::corner_bound_px(table::corner_information(scene)).value();
  };
  EXPECT_NEAR(bound_with(6) / bound_with(2), 3, 1e-9);
  scene.sensor.full_well_e = 20000;  // electrons are noise too
  const double with_shot = bound_with(2);
  scene.sensor.full_well_e = 0;
  EXPECT_GT(with_shot, 1.1 * bound_with(2));
}

TEST(CornerBound, IsNoneOfAnImageWithoutTheMarker) {
  sim::Scene scene = sim::close_up_scene(paper_camera(), {40, 2}, 1);
  scene.markers[0].pose.t[0] += 10;
  EXPECT_FALSE(table::corner_bound_px(table::corner_information(scene)));
}

TEST(SweepBound, AddsUpSquares) {
  table::SweepBound bound;
  bound.add({3, 0, 0, 1, 0, 0}, 0.3, 2);
  bound.add({4, 0, 0, 1, 0, 0}, 0.4, 2);
  EXPECT_EQ(bound.count(), 2);
  EXPECT_NEAR(bound.rms(0), std::sqrt(12.5), 1e-12);
  EXPECT_NEAR(bound.share(0), std::sqrt(12.5) / 2, 1e-12);
  EXPECT_NEAR(bound.position_share(), std::sqrt(12.5) / 2, 1e-12);
  EXPECT_NEAR(bound.corners_px(), std::sqrt(0.125), 1e-12);
  // Of the mean of n squares of equal normal numbers: 1 / √(2 n) of its root; here of squares 9 and 16.
  EXPECT_NEAR(bound.rms_deviation(3), 1 / std::sqrt(4.0), 1e-12);
  EXPECT_NEAR(bound.rms_deviation(0), std::sqrt(2 * (81.0 + 256)) / (2 * 2 * std::sqrt(12.5)), 1e-12);
}

}  // namespace
}  // namespace berth
