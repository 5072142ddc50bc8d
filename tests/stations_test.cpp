// Two stations against poses that are known: exact views, noisy views, wrong solutions, a mount that was bent.

#include "berth/stations.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <utility>

#include "sim/geometry.hpp"
#include "support/noisy_corners.hpp"
#include "target/marker_pose.hpp"

namespace berth {
namespace {

constexpr double kSide_m = 0.08, kNoise_px = 0.1;

/// The cameras of both look ahead, 12 cm beside the markers the other one sees; nothing is quite square.
StationPair stations() {
  StationPair pair;
  for (Station* station : {&pair.robot, &pair.dock}) {
    station->lens = paper_camera();
    station->marker_size_m = kSide_m;
    station->corner_deviation_px = kNoise_px;
  }
  pair.robot.camera = {sim::rotation(0.1, -0.2, 0.3), {0.4, 0.02, -0.03}};
  pair.robot.marker = {sim::rotation(-0.05, 0.1, 1.5), {0.0, 0.1, 0.02}};
  // In the marker's frame the other station's camera lies beside it and looks back along -z.
  const Pose back = {sim::rotation(0, radians(180), 0), {0.12, 0, 0}};
  pair.dock.camera = compose(pair.robot.marker, back);
  pair.dock.marker = compose(pair.robot.camera, inverse(back));
  return pair;
}

struct Scene {
  StationPair pair = stations();
  /// Robot frame to dock frame.
  Pose robot;
  /// What each camera sees of its marker: marker frame to camera frame.
  Pose to_robot, to_dock;
};

Scene scene_at(const Pose& dock_marker_in_robot_camera) {
  Scene scene;
  scene.to_robot = dock_marker_in_robot_camera;
  scene.robot = compose(scene.pair.robot.marker, compose(inverse(scene.to_robot), inverse(scene.pair.robot.camera)));
  scene.to_dock = compose(inverse(scene.pair.dock.camera), compose(scene.robot, scene.pair.dock.marker));
  return scene;
}

Scene random_scene(sim::Random& random) {
  const double z = random.uniform(0.3, 1);
  return scene_at({sim::rotation(random.uniform(-0.4, 0.4), random.uniform(-0.4, 0.4), random.uniform(-0.3, 0.3)),
                   {random.uniform(-0.1, 0.1) * z, random.uniform(-0.1, 0.1) * z, z}});
}

Detection view_of(const Pose& truth, sim::Random& random, double noise_px = kNoise_px) {
  const CameraModel camera = paper_camera();
  Detection view;
  view.corners = with_noise(seen_corners(camera, truth, kSide_m), noise_px, random);
  view.has_pose = marker_pose(camera, kSide_m, kNoise_px, view.corners, view.pose, view.pose_uncertainty.emplace());
  EXPECT_TRUE(view.has_pose);
  return view;
}

void expect_near(const Pose& a, const Pose& b, double tolerance) {
  for (const double value : step_between(a, b)) EXPECT_LT(std::fabs(value), tolerance);
}

TEST(Stations, AgreeOnExactViews) {
  sim::Random random(1);
  for (int i = 0; i < 100; ++i) {
    const Scene scene = random_scene(random);
    const Detection robot = view_of(scene.to_robot, random, 0), dock = view_of(scene.to_dock, random, 0);
    RelativePose pose;
    ASSERT_TRUE(relative_pose(scene.pair, &robot, &dock, pose));
    expect_near(pose.pose, scene.robot, 1e-6);
    expect_near({}, moved({}, pose.difference), 1e-5);
    EXPECT_LT(pose.disagreement, 1e-6);
    EXPECT_EQ(pose.views, 2);
    ASSERT_TRUE(relative_pose(scene.pair, &robot, nullptr, pose));
    expect_near(pose.pose, scene.robot, 1e-6);
    EXPECT_EQ(pose.views, 1);
    ASSERT_TRUE(relative_pose(scene.pair, nullptr, &dock, pose));
    expect_near(pose.pose, scene.robot, 1e-6);
  }
}

double apart(const Pose& a, const Pose& b) {
  double most = 0;
  for (const double value : step_between(a, b)) most = std::max(most, std::fabs(value));
  return most;
}

double turn_of_error(const Pose& found, const Pose& truth) {
  const auto error = step_between(found, truth);
  return length({error[3], error[4], error[5]});
}

TEST(Stations, KnowHowExactTheyAre) {
  sim::Random random(2);
  constexpr int kFrames = 4000;
  double squares = 0, disagreement = 0, turn = 0, turn_alone = 0;
  int wrong = 0, wrong_alone = 0;
  for (int i = 0; i < kFrames; ++i) {
    const Scene scene = random_scene(random);
    const Detection robot = view_of(scene.to_robot, random), dock = view_of(scene.to_dock, random);
    RelativePose both, alone;
    ASSERT_TRUE(relative_pose(scene.pair, &robot, &dock, both));
    ASSERT_TRUE(relative_pose(scene.pair, &robot, nullptr, alone));
    squares += mahalanobis(both.uncertainty.covariance, step_between(both.pose, scene.robot));
    disagreement += both.disagreement;
    const double error = turn_of_error(both.pose, scene.robot), error_alone = turn_of_error(alone.pose, scene.robot);
    turn += error * error;
    turn_alone += error_alone * error_alone;
    if (error > 0.1) ++wrong;
    if (error_alone > 0.1) ++wrong_alone;
  }
  // A chi-square of n degrees of freedom has variance 2 n: its mean over all frames within 2.6 deviations (99 %).
  EXPECT_NEAR(squares / kFrames, 6, 2.6 * std::sqrt(2 * 6.0 / kFrames));
  // One view alone is far from linear where it faces its marker.
  EXPECT_NEAR(disagreement / kFrames, 6, 0.3);
  // What one camera does not see well, how its marker is tilted, the other sees as a place beside.
  EXPECT_LT(std::sqrt(turn), 0.1 * std::sqrt(turn_alone));
  EXPECT_EQ(wrong, 0);
  EXPECT_GT(wrong_alone, 0) << "nothing was ambiguous";
}

TEST(Stations, TellThatAMountWasBent) {
  sim::Random random(3);
  int told = 0;
  // About its axis of view: turned about another, it only seems to see the robot from elsewhere.
  for (int i = 0; i < 200; ++i) {
    Scene scene = random_scene(random);
    const Detection robot = view_of(scene.to_robot, random), dock = view_of(scene.to_dock, random);
    scene.pair.dock.camera = compose(scene.pair.dock.camera, Pose{sim::rotation(0, 0, radians(2)), {}});
    RelativePose pose;
    ASSERT_TRUE(relative_pose(scene.pair, &robot, &dock, pose));
    if (pose.disagreement > 28) ++told;
  }
  EXPECT_EQ(told, 200);
}

TEST(Stations, NeedAViewWithItsUncertainty) {
  sim::Random random(4);
  const Scene scene = random_scene(random);
  Detection robot = view_of(scene.to_robot, random), dock = view_of(scene.to_dock, random);
  RelativePose pose;
  EXPECT_FALSE(relative_pose(scene.pair, nullptr, nullptr, pose));
  dock.has_pose = false;
  ASSERT_TRUE(relative_pose(scene.pair, &robot, &dock, pose));
  EXPECT_EQ(pose.views, 1);
  robot.pose_uncertainty.reset();
  pose.views = -1;
  EXPECT_FALSE(relative_pose(scene.pair, &robot, &dock, pose));
  EXPECT_EQ(pose.views, -1) << "left alone";
}

TEST(Stations, DoWithoutAViewWhoseCovarianceIsNone) {
  sim::Random random(5);
  const Scene scene = random_scene(random);
  const Detection robot = view_of(scene.to_robot, random), dock = view_of(scene.to_dock, random);
  for (const double variance : {0.0, -0.01, std::nan("")}) {
    Detection broken = dock;
    broken.corner_covariance_px2 = independent_corners(kNoise_px);
    (*broken.corner_covariance_px2)[9 * 3] = variance;
    RelativePose pose, alone;
    ASSERT_TRUE(relative_pose(scene.pair, &robot, nullptr, alone));
    ASSERT_TRUE(relative_pose(scene.pair, &robot, &broken, pose));
    EXPECT_EQ(pose.views, 1);
    EXPECT_EQ(pose.pose.t, alone.pose.t);
    EXPECT_FALSE(relative_pose(scene.pair, nullptr, &broken, pose));
  }
}

// By the corners as this station weighs them, whatever the detection came with.
TEST(Stations, TakeTheBetterOfAPlanesTwoPoses) {
  sim::Random random(6);
  int doubles = 0;
  for (int i = 0; i < 50; ++i) {
    const Scene scene = random_scene(random);
    const Detection robot = view_of(scene.to_robot, random);
    if (!robot.pose_uncertainty->has_other) continue;
    ++doubles;
    Detection swapped = robot;
    std::swap(swapped.pose, swapped.pose_uncertainty->other);
    RelativePose pose, same;
    ASSERT_TRUE(relative_pose(scene.pair, &robot, nullptr, pose));
    ASSERT_TRUE(relative_pose(scene.pair, &swapped, nullptr, same));
    EXPECT_GE(same.uncertainty.other_excess, 0);
    EXPECT_LT(apart(same.pose, pose.pose), 1e-6);
  }
  EXPECT_GT(doubles, 10);
}

}  // namespace
}  // namespace berth
