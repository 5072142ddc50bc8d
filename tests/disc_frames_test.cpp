// Targets of discs in whole frames: rendered ones against their truth, hidden, crowded, absent, on every backend.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "berth/detector.hpp"
#include "berth/error.hpp"
#include "sim/body.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"
#include "support/complaint.hpp"
#include "support/counted_allocations.hpp"
#include "support/disc_scene.hpp"
#include "target/refine_pose.hpp"
#include "target/symmetric.hpp"

namespace berth {
namespace {

using test::complaint;
using testing::HasSubstr;

DiscTarget shipped(const std::string& name) {
  return read_disc_target(std::string(BERTH_SOURCE_DIR) + "/targets/" + name + ".yaml");
}

/// Frames of one size on one backend.
class Frames {
 public:
  Frames(const CameraModel& camera, std::vector<DiscTarget> targets, const std::string& backend = "simd")
      : backend_(open_backend(backend)) {
    config_.camera = camera;
    config_.disc_targets = std::move(targets);
    detector_ = std::make_unique<Detector>(*backend_, camera.width, camera.height, config_);
  }
  const FrameResult& see(View2D<const u8> image) { return detector_->detect(image); }
  const DiscPose& find(const GrayImage& image) { return see(image.view()).disc_targets.at(0); }

 private:
  std::unique_ptr<Backend> backend_;
  DetectorConfig config_;
  std::unique_ptr<Detector> detector_;
};

double turned_by(const Pose& a, const Pose& b) {
  const std::array<double, 6> step = step_between(a, b);
  return std::sqrt(step[3] * step[3] + step[4] * step[4] + step[5] * step[5]);
}
/// Of the distance across the view.
double square_aside(const Pose& a, const Pose& b) {
  return (a.t[0] - b.t[0]) * (a.t[0] - b.t[0]) + (a.t[1] - b.t[1]) * (a.t[1] - b.t[1]);
}
double moved_by(const Pose& a, const Pose& b) { return length(add(a.t, scaled(b.t, -1))); }

// 30 frames of six: the mean of such a chi-square is within 6 +- 1.24 (95 %).
TEST(DiscFrames, PosesAreAsExactAsTheySayTheyAre) {
  const CameraModel camera = test::corner_camera(180, 180);
  const DiscTarget target = shipped("port");
  Frames frames(camera, {target});
  const sim::Renderer renderer(camera, 3);
  sim::Random random(7);
  double nees = 0, range = 0, turn = 0, aside = 0, aside_uncorrected = 0;
  constexpr int kFrames = 30;
  for (int i = 0; i < kFrames; ++i) {
    const Pose truth = test::random_target_pose(camera, target, 20, 50, random);
    const DiscPose& pose =
        frames.find(renderer.render(test::target_scene(camera, target, truth, 0.6, 2, random.bits())));
    ASSERT_TRUE(pose.has_pose) << i;
    EXPECT_EQ(pose.used, 5) << i;
    SquareMatrix<6> information{};
    ASSERT_TRUE(invert<6>(pose.uncertainty.covariance, information));
    nees += quadratic<6>(information, step_between(pose.pose, truth)) / kFrames;
    range += std::pow(moved_by(pose.pose, truth) / truth.t[2], 2) / kFrames;
    turn += std::pow(turned_by(pose.pose, truth), 2) / kFrames;
    aside += square_aside(pose.pose, truth) / kFrames;
    // The same centres taken for the discs' own.
    std::vector<PoseCorner> points;
    for (std::size_t k = 0; k < target.discs.size(); ++k) {
      points.push_back({{target.discs[k].x_m, target.discs[k].y_m, 0}, pose.discs[k].center_px, {1, 0, 1}});
    }
    RefinedPose uncorrected;
    ASSERT_TRUE(refine_pose(camera, points.data(), points.size(), truth, uncorrected));
    aside_uncorrected += square_aside(uncorrected.pose, truth) / kFrames;
  }
  EXPECT_GT(nees, 4.7);
  EXPECT_LT(nees, 7.3);
  EXPECT_LT(std::sqrt(range), 2e-4);
  EXPECT_LT(std::sqrt(turn), 0.0006);                             // 0.03 degrees
  EXPECT_GT(std::sqrt(aside_uncorrected), 2 * std::sqrt(aside));  // perspective moves all five one way
}

// Four symmetric discs and a cross: the arms tell which of the four ways it is turned.
TEST(DiscFrames, ACrossTellsHowItIsTurned) {
  const CameraModel camera = test::corner_camera(180, 180);
  const DiscTarget target = shipped("cross");
  Frames frames(camera, {target});
  const sim::Renderer renderer(camera);
  sim::Random random(8);
  for (int i = 0; i < 8; ++i) {
    const Pose truth = test::random_target_pose(camera, target, 22, 40, random);
    const DiscPose& pose =
        frames.find(renderer.render(test::target_scene(camera, target, truth, 0.6, 2, random.bits())));
    ASSERT_TRUE(pose.has_pose) << i;
    EXPECT_LT(turned_by(pose.pose, truth), 0.01) << i;
  }
}

/// A patch of the plate's own light over one disc.
void hide(sim::Scene& scene, const TargetDisc& disc, double albedo) {
  sim::Surface patch;
  patch.pose = compose(scene.targets[0].pose, translation(disc.x_m, disc.y_m, 0));
  const double h = 0.55 * disc.diameter_m;
  patch.outline = {{-h, -h}, {h, -h}, {h, h}, {-h, h}};
  patch.cells = {albedo};
  scene.foreground.push_back(patch);
}

// Any one of the port's five may be hidden, by something light or dark; with two of them it is not found.
TEST(DiscFrames, OneHiddenDiscOfFiveLeavesThePose) {
  const CameraModel camera = test::corner_camera(180, 180);
  const DiscTarget target = shipped("port");
  Frames frames(camera, {target});
  const sim::Renderer renderer(camera);
  sim::Random random(9);
  for (std::size_t k = 0; k < target.discs.size(); ++k) {
    for (const double albedo : {0.88, 0.1}) {
      const Pose truth = test::random_target_pose(camera, target, 20, 40, random);
      sim::Scene scene = test::target_scene(camera, target, truth, 0.6, 2, random.bits());
      hide(scene, target.discs[k], albedo);
      const DiscPose pose = frames.find(renderer.render(scene));
      ASSERT_TRUE(pose.has_pose) << k << " " << albedo;
      EXPECT_EQ(pose.used, 4);
      EXPECT_FALSE(pose.discs[k].seen);
      EXPECT_LT(turned_by(pose.pose, truth), 0.02) << k;
      hide(scene, target.discs[(k + 1) % 5], albedo);
      EXPECT_FALSE(frames.find(renderer.render(scene)).has_pose) << k << " " << albedo;
    }
  }
}

// Four in a square and a fifth that alone tells how it is turned: without that one there is no telling, and no pose.
TEST(DiscFrames, HidingWhatTellsTheTurnLeavesNone) {
  const CameraModel camera = test::corner_camera(180, 180);
  DiscTarget target;
  target.name = "fifth";
  target.discs = {{-0.05, -0.05, 0.03, 0},
                  {-0.05, 0.05, 0.03, 0},
                  {0.05, 0.05, 0.03, 0},
                  {0.05, -0.05, 0.03, 0},
                  {0, -0.05, 0.03, 0}};
  Frames frames(camera, {target});
  sim::Random random(15);
  for (std::size_t k = 0; k < target.discs.size(); ++k) {
    const Pose truth = test::random_target_pose(camera, target, 20, 30, random);
    sim::Scene scene = test::target_scene(camera, target, truth, 0.6, 2, random.bits());
    hide(scene, target.discs[k], 0.88);
    const DiscPose& pose = frames.find(sim::render(scene));
    EXPECT_EQ(pose.has_pose, k != 4) << k;
    if (pose.has_pose) {
      EXPECT_LT(turned_by(pose.pose, truth), 0.02) << k;
    }
  }
}

TEST(DiscFrames, OneHiddenDiscOfFourLeavesNone) {
  const CameraModel camera = test::corner_camera(180, 180);
  const DiscTarget target = shipped("cross");
  Frames frames(camera, {target});
  sim::Random random(10);
  const Pose truth = test::random_target_pose(camera, target, 22, 20, random);
  sim::Scene scene = test::target_scene(camera, target, truth, 0.6, 2, 1);
  EXPECT_TRUE(frames.find(sim::render(scene)).has_pose);
  hide(scene, target.discs[2], 0.88);
  const DiscPose& pose = frames.find(sim::render(scene));
  EXPECT_FALSE(pose.has_pose);
  EXPECT_EQ(pose.used, 0);
}

// Under so much blur that a ring's hole closes, there is no pose rather than one that is turned wrongly.
TEST(DiscFrames, BlurEndsInNoPoseAndNotInAWrongOne) {
  const CameraModel camera = test::corner_camera(180, 180);
  const DiscTarget target = shipped("port");
  Frames frames(camera, {target});
  const sim::Renderer renderer(camera);
  sim::Random random(11);
  int found = 0;
  for (int i = 0; i < 30; ++i) {
    const Pose truth = test::random_target_pose(camera, target, 20, 50, random);
    const double blur_px = 1.5 + 0.07 * i;
    const DiscPose& pose =
        frames.find(renderer.render(test::target_scene(camera, target, truth, blur_px, 2, random.bits())));
    if (!pose.has_pose) continue;
    ++found;
    EXPECT_LT(turned_by(pose.pose, truth), 0.05) << blur_px;
  }
  EXPECT_GT(found, 3);
  EXPECT_LT(found, 27);
}

// Other discs and rings all over the plate's surroundings, and a second target.
TEST(DiscFrames, OtherDiscsDoNotDisturb) {
  const CameraModel camera = test::corner_camera(320, 240);
  const DiscTarget target = shipped("port");
  Frames frames(camera, {target, shipped("cross")});
  const sim::Renderer renderer(camera);
  sim::Random random(12);
  for (int i = 0; i < 6; ++i) {
    const Pose truth = test::random_target_pose(camera, target, 16, 40, random);
    sim::Scene scene = test::target_scene(camera, target, truth, 0.6, 2, random.bits());
    sim::Surface wall;
    wall.pose = translation(0, 0, 1.6);
    wall.outline = {{-2, -2}, {2, -2}, {2, 2}, {-2, 2}};
    wall.cells = {0.7};
    scene.background = {wall};
    for (int k = 0; k < 40; ++k) {
      const double x = random.uniform(-0.8, 0.2), y = random.uniform(-0.6, 0.2), r = random.uniform(0.012, 0.03);
      scene.background.push_back(sim::disc(translation(0, 0, 1.59), x, y, r, k % 3 == 0 ? r / 2 : 0, 0.05));
    }
    const FrameResult& result = frames.see(renderer.render(scene).view());
    ASSERT_TRUE(result.disc_targets[0].has_pose) << i;
    EXPECT_LT(turned_by(result.disc_targets[0].pose, truth), 0.02) << i;
    EXPECT_FALSE(result.disc_targets[1].has_pose) << i;
    EXPECT_EQ(result.status, FrameStatus::ok);
  }
}

TEST(DiscFrames, NothingIsFoundWhereThereIsNone) {
  const CameraModel camera = paper_camera();
  Frames frames(camera, {shipped("port"), shipped("cross")});
  const sim::Renderer renderer(camera);
  for (const std::string& name : sim::corpus_names()) {
    for (int i = 0; i < 2; ++i) {
      const sim::Scene scene = sim::corpus_scene(name, 31 * i, camera.width, camera.height);
      for (const DiscPose& pose : frames.see(renderer.render(scene).view()).disc_targets) {
        EXPECT_FALSE(pose.has_pose) << name << " " << i;
      }
    }
  }
}

TEST(DiscFrames, NothingIsFoundInPhotosWithoutTargets) {
  const char* from_environment = std::getenv("BERTH_SHARED_DATA");
  const std::string data = from_environment != nullptr ? from_environment : BERTH_SHARED_DATA_DEFAULT;
  if (!std::filesystem::is_directory(data + "/photos")) GTEST_SKIP() << data << "/photos is not here";
  int photos = 0;
  for (const auto& entry : std::filesystem::directory_iterator(data + "/photos")) {
    const std::string ending = entry.path().extension().string();
    if (ending != ".jpg" && ending != ".png") continue;
    const cv::Mat picture = cv::imread(entry.path().string(), cv::IMREAD_GRAYSCALE);
    ASSERT_FALSE(picture.empty()) << entry.path();
    // Nobody knows these lenses; a plain one of usual angle does.
    CameraModel camera;
    camera.width = picture.cols;
    camera.height = picture.rows;
    camera.fx = camera.fy = picture.cols;
    camera.cx = picture.cols / 2.0;
    camera.cy = picture.rows / 2.0;
    Frames frames(camera, {shipped("port"), shipped("cross")});
    const View2D<const u8> image{picture.data, picture.cols, picture.rows, static_cast<int>(picture.step)};
    for (const DiscPose& pose : frames.see(image).disc_targets) EXPECT_FALSE(pose.has_pose) << entry.path();
    ++photos;
  }
  EXPECT_GT(photos, 15);
}

TEST(DiscFrames, EveryBackendGivesTheSameBits) {
  const CameraModel camera = test::corner_camera(200, 180);
  const DiscTarget target = shipped("port");
  sim::Random random(13);
  const Pose truth = test::random_target_pose(camera, target, 20, 30, random);
  const GrayImage image = sim::render(test::target_scene(camera, target, truth, 0.6, 2, 5));
  const DiscPose expected = Frames(camera, {target}, "reference").find(image);
  ASSERT_TRUE(expected.has_pose);
  for (const std::string& name : backend_names()) {
    std::unique_ptr<Frames> frames;
    try {
      frames = std::make_unique<Frames>(camera, std::vector<DiscTarget>{target}, name);
    } catch (const Error&) {
      continue;  // no such device here; conformance_test says which must be
    }
    const DiscPose& pose = frames->find(image);
    EXPECT_EQ(pose.pose.R, expected.pose.R) << name;
    EXPECT_EQ(pose.pose.t, expected.pose.t) << name;
    EXPECT_EQ(pose.uncertainty.covariance, expected.uncertainty.covariance) << name;
    for (std::size_t k = 0; k < target.discs.size(); ++k) {
      EXPECT_EQ(pose.discs[k].center_px, expected.discs[k].center_px) << name;
    }
  }
}

TEST(DiscFrames, FramesAllocateNothing) {
  const CameraModel camera = test::corner_camera(320, 240);
  const DiscTarget target = shipped("port");
  Frames frames(camera, {target});
  sim::Random random(14);
  const Pose truth = test::random_target_pose(camera, target, 20, 30, random);
  const GrayImage image = sim::render(test::target_scene(camera, target, truth, 0.6, 2, 5));
  frames.see(image.view());
  const std::size_t before = test::allocations();
  EXPECT_TRUE(frames.find(image).has_pose);
  EXPECT_EQ(test::allocations(), before);
}

TEST(DiscFrames, WhatDoesNotHoldIsRefused) {
  const auto backend = open_backend("simd");
  DetectorConfig config;
  config.disc_targets = {shipped("port")};
  const auto made = [&] { Detector detector(*backend, 640, 480, config); };
  EXPECT_THAT(complaint(made), HasSubstr("without a camera; give the camera's calibration"));
  config.camera = paper_camera();
  EXPECT_EQ(complaint(made), "");
  config.disc_targets.push_back(shipped("port"));
  EXPECT_THAT(complaint(made), HasSubstr("two targets are named \"port\""));
  config.disc_targets = {DiscTarget()};
  EXPECT_THAT(complaint(made), HasSubstr("has 0 discs; give 4 to 16"));
}

}  // namespace
}  // namespace berth
