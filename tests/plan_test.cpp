// Predictions of a pose's error against what comes out of rendered frames.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "berth/detector.hpp"
#include "plan/predict.hpp"
#include "sim/geometry.hpp"
#include "sim/random.hpp"
#include "support/command_run.hpp"
#include "table/pose_error.hpp"
#include "table/stage.hpp"

namespace berth {
namespace {

using testing::HasSubstr;

struct Case {
  const char* name;
  double side_px, blur_px, read_noise, white;
};

/// Errors of many views in units of their own predictions, position and rotation.
struct Outcome {
  std::array<table::ErrorSum, 6> axes;
  table::ErrorSum position, rotation;
};

constexpr double kSize_m = 0.08;
constexpr int kViews = 100;

/// The middle of the paper's: a quarter of the pixels to render.
CameraModel small_camera() {
  CameraModel camera = paper_camera();
  camera.width = 320;
  camera.height = 240;
  camera.cx -= 160;
  camera.cy -= 120;
  return camera;
}

Outcome outcome_of(const Case& one) {
  plan::View view;
  view.camera = small_camera();
  view.size_m = kSize_m;
  view.sensor.blur_sigma_px = one.blur_px;
  view.sensor.read_noise = one.read_noise;
  view.sensor.white_level = one.white;
  const table::Stage stage(view.camera, view.sensor);
  const auto backend = open_backend("simd");
  DetectorConfig config;
  config.camera = view.camera;
  config.marker_size_m = kSize_m;
  Detector detector(*backend, view.camera.width, view.camera.height, config);
  sim::Random random(11);
  const double z = view.camera.fx * kSize_m / one.side_px;
  Outcome outcome;
  for (int i = 0; i < kViews; ++i) {
    const double x = random.uniform(-0.08, 0.08) * z;
    const double y = random.uniform(-0.05, 0.05) * z;
    // Tilted, so that there is no doubt which pose of the plane it is.
    const double tilt = random.uniform(0.5, 0.9);
    const double way = random.uniform(-3.1, 3.1);
    const double roll = random.uniform(-3.1, 3.1);
    view.pose.t = {x, y, z};
    view.pose.R = sim::product(sim::rotation_z(way), sim::product(sim::rotation_x(tilt), sim::rotation_z(roll)));
    view.light = 0.35 + 0.65 * sim::exact_cos(tilt);
    plan::Prediction prediction;
    EXPECT_TRUE(plan::predict(view, prediction));
    const table::StageFrame frame = stage.look({0, kSize_m, view.pose}, static_cast<u64>(i) + 1);
    for (const Detection& detection : detector.detect(frame.image.view()).detections) {
      const table::SixAxes error = table::pose_error(detection.pose, view.pose);
      for (std::size_t k = 0; k < 6; ++k) outcome.axes[k].add(error[k] / prediction.deviation[k]);
      const table::SixAxes& d = prediction.deviation;
      outcome.position.add(sim::length({error[0], error[1], error[2]}) / prediction.position_m);
      outcome.rotation.add(sim::length({error[3], error[4], error[5]}) / sim::length({d[3], d[4], d[5]}));
    }
  }
  return outcome;
}

TEST(Plan, PredictsWhatRenderedFramesShowWithinAFifth) {
  std::array<double, 6> squares{};
  int cases = 0;
  for (const Case& one :
       {Case{"30 px", 30, 0.7, 1.8, 210}, Case{"40 px, noisy", 40, 0.7, 4, 210}, Case{"50 px", 50, 0.7, 1.8, 210},
        Case{"50 px, sharp", 50, 0.5, 3, 210}, Case{"60 px, dim", 60, 0.7, 1.8, 70},
        Case{"80 px, noisy, blurred", 80, 0.9, 4, 210}, Case{"120 px", 120, 0.7, 1.8, 210}}) {
    SCOPED_TRACE(one.name);
    const Outcome outcome = outcome_of(one);
    EXPECT_EQ(outcome.position.count(), kViews);
    EXPECT_NEAR(outcome.position.rms(), 1, 0.2);
    EXPECT_NEAR(outcome.rotation.rms(), 1, 0.2);
    for (std::size_t k = 0; k < 6; ++k) squares[k] += outcome.axes[k].rms() * outcome.axes[k].rms();
    ++cases;
  }
  // A setting's 100 views alone say an axis' deviation to 7 %.
  for (std::size_t k = 0; k < 6; ++k) EXPECT_NEAR(std::sqrt(squares[k] / cases), 1, 0.2) << "axis " << k;
}

TEST(Plan, KnowsHowFarAMarkerIsRead) {
  for (const double blur_px : {0.7, 1.5}) {
    SCOPED_TRACE(blur_px);
    plan::View view;
    view.camera = small_camera();
    view.size_m = kSize_m;
    view.sensor.blur_sigma_px = blur_px;
    view.pose = sim::translation(0, 0, 1);
    const double range_m = plan::decode_range_m(view, family(table::kFamily));
    const table::Stage stage(view.camera, view.sensor);
    const auto backend = open_backend("simd");
    Detector detector(*backend, view.camera.width, view.camera.height, DetectorConfig{});
    const auto found_at = [&](double z) {
      sim::Random random(5);
      int found = 0;
      for (int i = 0; i < 20; ++i) {
        const double x = random.uniform(-0.05, 0.05) * z;
        Pose pose = sim::translation(x, 0, z);
        pose.R = sim::rotation_z(random.uniform(-3.1, 3.1));
        for (const Detection& d : detector.detect(stage.look({0, kSize_m, pose}, 1).image.view()).detections) {
          found += d.id == table::kMarker ? 1 : 0;
        }
      }
      return found;
    };
    EXPECT_GE(found_at(0.95 * range_m), 18);
    EXPECT_LE(found_at(1.4 * range_m), 6);
  }
}

TEST(Plan, GrowsWithWhatMakesPosesWorse) {
  plan::View view;
  view.size_m = kSize_m;
  view.pose = sim::translation(0, 0, 0.8);
  view.pose.R = sim::rotation_y(0.6);
  const auto position = [](const plan::View& one) {
    plan::Prediction prediction;
    EXPECT_TRUE(plan::predict(one, prediction));
    return prediction.position_m;
  };
  const double base = position(view);
  plan::View worse = view;
  worse.sensor.read_noise *= 3;
  EXPECT_GT(position(worse), 1.3 * base);
  worse = view;
  worse.motion_px = 4;
  EXPECT_GT(position(worse), 1.3 * base);
  worse = view;
  worse.light = 0.2;
  EXPECT_GT(position(worse), 1.3 * base);
  worse = view;
  worse.pose.t[2] *= 1.5;
  EXPECT_GT(position(worse), 1.5 * base);
  plan::View behind = view;
  behind.pose.t[2] = -1;
  plan::Prediction prediction;
  EXPECT_FALSE(plan::predict(behind, prediction));
}

TEST(CliPlan, PrintsAPrediction) {
  const auto run = test::run_berth({"plan", "--size", "0.08", "--range", "0.05,0.5,9", "--lens", "6", "--pixel", "4.8",
                                    "--image", "640x480", "--backend", "simd", "--exposure", "20"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("f 1250.00 1250.00 px"));
  EXPECT_THAT(run.out, HasSubstr("| 0.050 | does not fit |"));
  EXPECT_THAT(run.out, HasSubstr("| 0.500 | "));
  EXPECT_THAT(run.out, HasSubstr("| too far |"));
  EXPECT_THAT(run.out, HasSubstr("decode range"));
  EXPECT_THAT(run.out, HasSubstr("50 frames/s: the exposure"));
}

TEST(CliPlan, SaysWhatItCannotDo) {
  const auto refused = [](std::vector<std::string> more, const char* words) {
    std::vector<std::string> arguments = {"plan", "--size", "0.08"};
    arguments.insert(arguments.end(), more.begin(), more.end());
    const auto run = test::run_berth(arguments);
    EXPECT_EQ(run.exit_code, 2);
    EXPECT_THAT(run.err, HasSubstr(words));
  };
  refused({"--range", "1:"}, "FROM:TO");
  refused({"--range", "0.5,x"}, "FROM:TO");
  refused({"--lens", "6"}, "--pixel");
  refused({"--lens", "6", "--pixel", "4", "--image", "640"}, "640x480");
  refused({"--family", "tag36h12"}, "tag36h11");
  refused({"--angle", "89"}, "--angle");
}

}  // namespace
}  // namespace berth
