// The simulator is the truth of every accuracy test, so it is judged here by what it does not share code with: OpenCV's
// projection, the integral of edge profiles, libapriltag, and libm.
#include <apriltag/apriltag.h>
#include <apriltag/tag16h5.h>
#include <apriltag/tag25h9.h>
#include <apriltag/tag36h11.h>
#include <apriltag/tagCircle21h7.h>
#include <apriltag/tagStandard41h12.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <opencv2/calib3d.hpp>
#include <string>
#include <thread>
#include <vector>

#include "berth/error.hpp"
#include "exact_math.hpp"
#include "sim/body.hpp"
#include "sim/corpus.hpp"
#include "sim/printed_marker.hpp"
#include "sim/render.hpp"
#include "support/image_digest.hpp"

namespace berth::sim {
namespace {

Pose pose_at(double rx_deg, double ry_deg, double rz_deg, const Vec3& t) {
  Pose pose;
  pose.R = rotation(radians(rx_deg), radians(ry_deg), radians(rz_deg));
  pose.t = t;
  return pose;
}

// A marker in flat light, without noise.
Scene clean_scene(const Pose& pose) {
  Scene scene;
  scene.camera = paper_camera();
  scene.lighting.ambient = 1;
  scene.lighting.direct = 0;
  scene.sensor.vignetting = 0;
  scene.sensor.full_well_e = 1e12;
  scene.sensor.read_noise = 0;
  // Light and dark are whole grey levels, 188 and 18: rounding leaves them alone.
  scene.sensor.white_level = 208;
  SceneMarker marker;
  marker.white = 0.9;
  marker.black = 0.05;
  marker.id = 7;
  marker.pose = pose;
  marker.margin_modules = 1;
  scene.markers = {marker};
  scene.void_albedo = marker.white;
  return scene;
}

TEST(ExactMath, AgreesWithLibm) {
  for (double x = -30; x <= 30; x += 0.37) {
    EXPECT_NEAR(exact_exp(x) / std::exp(x), 1, 1e-14) << x;
    EXPECT_NEAR(exact_sin(x), std::sin(x), 3e-15) << x;
    EXPECT_NEAR(exact_cos(x), std::cos(x), 3e-15) << x;
    EXPECT_NEAR(exact_atan(x), std::atan(x), 5e-16) << x;
  }
  for (double x = 1e-9; x < 1e9; x *= 1.9) {
    EXPECT_NEAR(exact_log(x), std::log(x), 1e-14 * std::max(1.0, std::fabs(std::log(x)))) << x;
    EXPECT_NEAR(exact_pow(x, 0.45) / std::pow(x, 0.45), 1, 1e-13) << x;
    EXPECT_NEAR(exact_atan(-x) / std::atan(-x), 1, 8e-16) << x;
  }
  EXPECT_EQ(exact_pow(0, 0.45), 0);
}

TEST(ExactMath, QuantileInvertsTheNormalDistribution) {
  for (double p : {3e-11, 1e-7, 1e-3, 0.02, 0.0749, 0.0751, 0.3, 0.5, 0.7, 0.99, 1 - 1e-6}) {
    const double x = normal_quantile(p);
    EXPECT_NEAR(0.5 * std::erfc(-x / std::sqrt(2.0)) / p, 1, 1e-9) << p;
  }
}

TEST(Truth, CornersAreWhereOpenCvProjectsThem) {
  Scene scene = clean_scene(pose_at(20, -35, 50, {0.12, -0.07, 0.5}));
  scene.camera.distortion = {-0.1116, 0.1242, 0.001, -0.002, 0.01};
  const CameraModel& c = scene.camera;
  const Pose& p = scene.markers[0].pose;
  std::vector<cv::Point3d> points;
  // Paper's order, marker frame x right and y down.
  for (const Vec2& corner : {Vec2{-1, -1}, Vec2{-1, 1}, Vec2{1, 1}, Vec2{1, -1}}) {
    points.emplace_back(0.05 * corner[0], 0.05 * corner[1], 0);
  }
  cv::Mat rotation_vector;
  cv::Rodrigues(cv::Mat(3, 3, CV_64F, const_cast<double*>(p.R.data())), rotation_vector);
  std::vector<cv::Point2d> expected;
  cv::projectPoints(points, rotation_vector, cv::Vec3d(p.t[0], p.t[1], p.t[2]),
                    cv::Matx33d(c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1),
                    std::vector<double>(c.distortion.begin(), c.distortion.end()), expected);
  const std::vector<TruthMarker> seen = truth(scene);
  ASSERT_EQ(seen.size(), 1u);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(seen[0].corners[i][0], expected[i].x, 1e-9);
    EXPECT_NEAR(seen[0].corners[i][1], expected[i].y, 1e-9);
  }
}

TEST(Truth, AFisheyeIsWhatOpenCvSays) {
  CameraModel camera = paper_camera();
  camera.fx = 302;
  camera.fy = 301;
  camera.lens = LensModel::equidistant;
  camera.distortion = {-0.03, 0.012, -0.006, 0.001};
  const RayMap rays(camera);
  for (int row = 0; row <= camera.height; row += 48) {
    for (int column = 0; column <= camera.width; column += 64) {
      const Vec2& ray = rays.corner(column, row);
      std::vector<cv::Point2d> expected;
      cv::fisheye::projectPoints(std::vector<cv::Point3d>{{ray[0], ray[1], 1}}, expected, cv::Vec3d(), cv::Vec3d(),
                                 cv::Matx33d(camera.fx, 0, camera.cx, 0, camera.fy, camera.cy, 0, 0, 1),
                                 cv::Vec4d(-0.03, 0.012, -0.006, 0.001));
      EXPECT_NEAR(expected[0].x, column - 0.5, 1e-9);
      EXPECT_NEAR(expected[0].y, row - 0.5, 1e-9);
      const Vec2 pixel = image_point(camera, ray);
      EXPECT_NEAR(pixel[0], expected[0].x, 1e-9);
      EXPECT_NEAR(pixel[1], expected[0].y, 1e-9);
    }
  }
  camera.fx = camera.fy = 200;
  EXPECT_THROW(RayMap{camera}, Error);  // beyond 83 degrees
}

TEST(Truth, RayMapInvertsTheLens) {
  CameraModel camera = paper_camera();
  camera.distortion = {-0.3, 0.1, 0.002, -0.001, 0.02};
  const RayMap rays(camera);
  for (int row = 0; row <= camera.height; row += 48) {
    for (int column = 0; column <= camera.width; column += 64) {
      const std::array<double, 2> pixel = camera.project(rays.corner(column, row)[0], rays.corner(column, row)[1]);
      EXPECT_NEAR(pixel[0], column - 0.5, 1e-9);
      EXPECT_NEAR(pixel[1], row - 0.5, 1e-9);
    }
  }
  camera.distortion = {-2, 0, 0, 0, 0};
  EXPECT_THROW(RayMap{camera}, Error);
}

// Where each row (or column) of pixels crosses the border's edge from corner i to the next: the integral of the profile
// over a window of ± reach, light outside and dark inside. For a straight edge, pixel areas and any symmetric blur
// leave that integral exact. Returns rendered minus true position along the scan, px.
std::vector<double> edge_errors(const Scene& scene, const GrayImage& image, int edge, int reach) {
  const CameraModel& camera = scene.camera;
  const SceneMarker& marker = scene.markers[0];
  const std::array<Vec3, 4> corners = marker_corners(marker.size_m);
  const Vec3 a = corners[static_cast<std::size_t>(edge)], b = corners[static_cast<std::size_t>((edge + 1) % 4)];
  const double light = scene.sensor.black_level + (scene.sensor.white_level - scene.sensor.black_level) * marker.white;
  const double dark = scene.sensor.black_level + (scene.sensor.white_level - scene.sensor.black_level) * marker.black;
  const auto along = [&](double s) {
    const Vec3 p = transform(marker.pose, {a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), 0});
    return camera.project(p[0] / p[2], p[1] / p[2]);
  };
  const bool by_row = std::fabs(along(1)[1] - along(0)[1]) > std::fabs(along(1)[0] - along(0)[0]);
  const std::size_t across = by_row ? 0 : 1, line = by_row ? 1 : 0;
  // Dark lies towards the marker's middle.
  const std::array<double, 2> middle =
      camera.project(marker.pose.t[0] / marker.pose.t[2], marker.pose.t[1] / marker.pose.t[2]);
  const double towards_dark = middle[across] > along(0.5)[across] ? 1 : -1;
  std::vector<double> errors;
  const double first = std::min(along(0.12)[line], along(0.88)[line]),
               last = std::max(along(0.12)[line], along(0.88)[line]);
  for (int at = static_cast<int>(first) + 1; at <= static_cast<int>(last); ++at) {
    double low = 0, high = 1;
    for (int i = 0; i < 60; ++i) {
      const double half = 0.5 * (low + high);
      ((along(half)[line] < at) == (along(0)[line] < along(1)[line]) ? low : high) = half;
    }
    const double expected = along(low)[across];
    const int center = static_cast<int>(std::lround(expected));
    double dark_pixels = 0;
    for (int i = -reach; i <= reach; ++i) {
      const double grey = by_row ? image.view().at(center + i, at) : image.view().at(at, center + i);
      dark_pixels += (light - grey) / (light - dark);
    }
    const double found = towards_dark > 0 ? center + reach + 0.5 - dark_pixels : center - reach - 0.5 + dark_pixels;
    errors.push_back(found - expected);
  }
  return errors;
}

TEST(Render, EdgesAreAtTheTruth) {
  int edges = 0;
  for (const Pose& pose : {pose_at(0, 0, 0, {0.003, 0.001, 0.33}), pose_at(25, -20, 12, {0.04, -0.03, 0.36}),
                           pose_at(-30, 35, 61, {-0.05, 0.02, 0.34}), pose_at(5, 8, -37, {0.06, 0.04, 0.3})}) {
    const Scene scene = clean_scene(pose);
    const GrayImage image = render(scene);
    for (int edge = 0; edge < 4; ++edge) {
      const std::vector<double> errors = edge_errors(scene, image, edge, 7);
      ASSERT_GT(errors.size(), 60u);
      double mean = 0, worst = 0;
      for (double e : errors) {
        mean += e / static_cast<double>(errors.size());
        worst = std::max(worst, std::fabs(e));
      }
      // A line of 15 pixels rounded to 8 bits has a standard deviation of 0.006 px at this contrast.
      EXPECT_LT(std::fabs(mean), 0.002) << "edge " << edge;
      EXPECT_LT(worst, 0.02) << "edge " << edge;
      ++edges;
    }
  }
  EXPECT_EQ(edges, 16);
}

TEST(Render, MotionBlurIsCentredOnMidExposureAndAsWideAsTheMotion) {
  Scene scene = clean_scene(pose_at(3, 2, 4, {0.002, 0.001, 0.3}));
  const double blur_px = 6;
  scene.motion.turn = {0, blur_px / scene.camera.fx, 0};
  const GrayImage image = render(scene);
  for (int edge : {0, 2}) {
    double mean = 0;
    const std::vector<double> errors = edge_errors(scene, image, edge, 10);
    for (double e : errors) mean += e / static_cast<double>(errors.size());
    EXPECT_LT(std::fabs(mean), 0.01) << "edge " << edge;
  }
  // The slope of the profile is the spread of the edge: variance of motion, pixel and blur, and the edge's own slant.
  const std::vector<TruthMarker> seen = truth(scene);
  const int row = static_cast<int>(seen[0].corners[0][1] + 0.5 * (seen[0].corners[1][1] - seen[0].corners[0][1]));
  const int center = static_cast<int>(0.5 * (seen[0].corners[0][0] + seen[0].corners[1][0]));
  double sum = 0, first = 0, second = 0;
  for (int x = center - 12; x <= center + 12; ++x) {
    const double slope = image.view().at(x - 1, row) - image.view().at(x, row);
    sum += slope;
    first += slope * (x - 0.5);
    second += slope * (x - 0.5) * (x - 0.5);
  }
  const double variance = second / sum - (first / sum) * (first / sum);
  const double sigma = scene.sensor.blur_sigma_px;
  EXPECT_NEAR(variance, blur_px * blur_px / 12 + sigma * sigma + 1.0 / 12, 0.35);
}

TEST(Render, NoiseHasTheStatedVariance) {
  Scene scene = clean_scene(Pose{});
  scene.markers.clear();
  scene.camera = paper_camera(320, 240);
  scene.void_albedo = 0.5;
  scene.sensor.white_level = 208;
  scene.sensor.black_level = 8;
  scene.sensor.full_well_e = 10000;
  scene.sensor.read_noise = 2;
  for (const double gamma : {1.0, 0.8}) {
    scene.sensor.gamma = gamma;
    const GrayImage image = render(scene);
    double mean = 0, square = 0, right = 0, cube = 0;
    const double count = 320 * 240;
    const double expected = 255 * std::pow(108.0 / 255, gamma);
    for (int y = 0; y < 240; ++y) {
      for (int x = 0; x < 320; ++x) {
        const double d = image.view().at(x, y) - expected;
        mean += d / count;
        square += d * d / count;
        cube += d * d * d * d / count;
        if (x > 0) right += d * (image.view().at(x - 1, y) - expected) / count;
      }
    }
    // Shot noise of 100 grey levels through the slope of the tone curve, read noise, rounding.
    const double slope = gamma * expected / 108;
    const double variance = 100 * 255.0 / 10000 * slope * slope + 4 + 1.0 / 12;
    EXPECT_NEAR(mean, 0, 0.05);
    EXPECT_NEAR(square / variance, 1, 0.03) << gamma;
    EXPECT_NEAR(right / variance, 0, 0.02) << "neighbours are independent";
    EXPECT_NEAR(cube / (variance * variance), 3, 0.15) << "and normal";
  }
}

TEST(Render, ThreadsAndRendererDoNotMatter) {
  const Scene scene = corpus_scene("hard", 4, 320, 240);
  const Renderer renderer(scene.camera);
  const u64 alone = test::image_digest(render(scene));
  u64 first = 0, second = 0;
  std::thread one([&] { first = test::image_digest(renderer.render(scene)); });
  std::thread two([&] { second = test::image_digest(renderer.render(scene)); });
  one.join();
  two.join();
  EXPECT_EQ(first, alone);
  EXPECT_EQ(second, alone);
}

TEST(Render, EverythingAtOnceHasTheGoldenBits) {
  Scene scene = corpus_scene("cluttered", 1, 240, 180);
  scene.lighting.shadows = {Shadow{}};
  scene.lighting.glares = {Glare{}};
  scene.sensor.gamma = 0.7;
  scene.sensor.defocus_px = 1.2;
  scene.motion.turn = {0.003, 0.004, 0.002};
  scene.motion.shift = {0.001, 0, -0.002};
  add_finger(scene.foreground, {0.1, 0.1}, 0.4, 0.05, 0.2, 0.3);
  EXPECT_EQ(test::image_digest(render(scene)), 0x6d86cd2c0ddb0211u);
}

TEST(Render, ACameraThatIsNotTheRenderersIsAnError) {
  const Scene scene = clean_scene(pose_at(0, 0, 0, {0, 0, 0.5}));
  const Renderer renderer(paper_camera(320, 240));
  EXPECT_THROW(renderer.render(scene), Error);
  Scene unknown = scene;
  unknown.markers[0].family = "tag99h9";
  EXPECT_THROW(render(unknown), Error);
  unknown.markers[0] = scene.markers[0];
  unknown.markers[0].id = 587;
  EXPECT_THROW(render(unknown), Error);
}

TEST(Truth, VisibleShareCountsRimAndOccluders) {
  Scene scene = clean_scene(pose_at(0, 0, 0, {0, 0, 0.5}));
  EXPECT_EQ(truth(scene)[0].visible, 1);
  // A board at the marker's distance over its left half, quiet zone included.
  scene.foreground = {flat(translation(0, 0, 0.5), -0.5, 0, 1, 1, 0.3)};
  EXPECT_NEAR(truth(scene)[0].visible, 0.5, 0.02);
  scene.foreground.clear();
  // The middle of the marker on the image's left rim.
  scene.markers[0].pose.t[0] = 0.5 * RayMap(scene.camera).corner(0, 240)[0];
  EXPECT_NEAR(truth(scene)[0].visible, 0.5, 0.02);
  scene.markers[0].pose.t = {0, 0, -0.5};
  EXPECT_EQ(truth(scene)[0].visible, 0);
  scene.markers[0].pose = pose_at(180, 0, 0, {0, 0, 0.5});
  EXPECT_EQ(truth(scene)[0].visible, 0) << "seen from behind";
}

struct JudgeFamily {
  const char* name;
  apriltag_family_t* (*create)();
  void (*destroy)(apriltag_family_t*);
};

class EveryAprilTagFamily : public testing::TestWithParam<JudgeFamily> {};

TEST_P(EveryAprilTagFamily, IsReadByLibapriltag) {
  const JudgeFamily judge = GetParam();
  Scene scene = clean_scene(pose_at(12, -18, 25, {0.02, -0.01, 0.5}));
  scene.void_albedo = 0.4;
  scene.markers[0].family = judge.name;
  scene.markers[0].id = 5;
  GrayImage image = render(scene);
  apriltag_family_t* shape = judge.create();
  apriltag_detector_t* detector = apriltag_detector_create();
  apriltag_detector_add_family_bits(detector, shape, 0);
  detector->quad_decimate = 1;
  image_u8_t view = {image.width(), image.height(), image.width(), image.view().data};
  zarray_t* found = apriltag_detector_detect(detector, &view);
  EXPECT_EQ(zarray_size(found), 1);
  const TruthMarker expected = truth(scene)[0];
  for (int i = 0; i < zarray_size(found); ++i) {
    apriltag_detection_t* one = nullptr;
    zarray_get(found, i, &one);
    EXPECT_EQ(one->id, 5);
    // libapriltag's corners start at the lower left and go counter-clockwise; pixel centres at + 0.5.
    for (std::size_t k = 0; k < 4; ++k) {
      EXPECT_NEAR(one->p[(k + 3) % 4][0] - 0.5, expected.corners[k][0], 0.5);
      EXPECT_NEAR(one->p[(k + 3) % 4][1] - 0.5, expected.corners[k][1], 0.5);
    }
  }
  apriltag_detections_destroy(found);
  apriltag_detector_destroy(detector);
  judge.destroy(shape);
}

INSTANTIATE_TEST_SUITE_P(Sim, EveryAprilTagFamily,
                         testing::Values(JudgeFamily{"tag36h11", tag36h11_create, tag36h11_destroy},
                                         JudgeFamily{"tag25h9", tag25h9_create, tag25h9_destroy},
                                         JudgeFamily{"tag16h5", tag16h5_create, tag16h5_destroy},
                                         JudgeFamily{"tagCircle21h7", tagCircle21h7_create, tagCircle21h7_destroy},
                                         JudgeFamily{"tagStandard41h12", tagStandard41h12_create,
                                                     tagStandard41h12_destroy}),
                         [](const auto& one) { return std::string(one.param.name); });

}  // namespace
}  // namespace berth::sim
