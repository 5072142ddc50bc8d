// Poses of bundles: by exact corners the exact pose, by noisy ones a pose and a covariance that hold, and neither moved
// by a marker out of place, a wrong corner or one read twice.

#include "berth/bundle.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "berth/detector.hpp"
#include "berth/error.hpp"
#include "sim/geometry.hpp"
#include "sim/random.hpp"
#include "sim/render.hpp"
#include "support/counted_allocations.hpp"
#include "support/noisy_corners.hpp"
#include "target/bundle_pose.hpp"
#include "target/marker_pose.hpp"
#include "target/symmetric.hpp"

namespace berth {
namespace {

constexpr double kDeviation_px = 0.15;

/// scenarios/approach.toml's: 100 mm in the middle, four of 30 mm about it.
Bundle dock() {
  Bundle bundle;
  bundle.name = "dock";
  const MarkerFamily* tags = &family("tag36h11");
  bundle.markers = {{tags, 0, 0.1, {}},
                    {tags, 1, 0.03, translation(-0.09, -0.055, 0)},
                    {tags, 2, 0.03, translation(-0.09, 0.055, 0)},
                    {tags, 3, 0.03, translation(0.09, 0.055, 0)},
                    {tags, 4, 0.03, translation(0.09, -0.055, 0)}};
  return bundle;
}

/// Two sides of a box that meet at an upright edge, 90 degrees apart, and a bundle frame far away from both.
Bundle corner_of_a_box() {
  Bundle bundle;
  const MarkerFamily* tags = &family("tag36h11");
  bundle.markers = {{tags, 0, 0.08, {sim::rotation_y(radians(45)), {5.04, 2, -0.3}}},
                    {tags, 1, 0.08, {sim::rotation_y(radians(-45)), {4.96, 2, -0.3}}}};
  return bundle;
}

/// A frame of the bundle's markers at a pose, each corner off by noise, each marker with its own pose. Markers that are
/// seen from behind are not in it.
std::vector<Detection> seen(const CameraModel& camera, const Bundle& bundle, const Pose& truth, double noise_px,
                            sim::Random& random) {
  std::vector<Detection> detections;
  for (const BundleMarker& marker : bundle.markers) {
    const Pose pose = compose(truth, marker.pose);
    if (!faces_camera(pose)) continue;
    Detection detection;
    detection.family = marker.family;
    detection.id = marker.id;
    const std::array<Vec3, 4> places = corner_places(marker.size_m);
    for (std::size_t i = 0; i < 4; ++i) {
      detection.corners[i] = image_of(camera, transform(pose, places[i]));
      for (double& value : detection.corners[i]) value += noise_px * normal(random);
    }
    detections.push_back(detection);
  }
  return detections;
}

void add_own_poses(const CameraModel& camera, const Bundle& bundle, std::vector<Detection>& detections) {
  for (Detection& d : detections) {
    const BundleMarker* marker = bundle.find(*d.family, d.id);
    d.has_pose = marker_pose(camera, marker->size_m, kDeviation_px, d.corners, d.pose, d.pose_uncertainty.emplace());
    if (!d.has_pose) d.pose_uncertainty.reset();
  }
}

BundlePose found(const CameraModel& camera, const Bundle& bundle, std::vector<Detection> detections) {
  add_own_poses(camera, bundle, detections);
  BundlePoser poser(bundle);
  BundlePose pose;
  poser.find(camera, detections, kDeviation_px, pose);
  return pose;
}

/// At a range, anywhere about the optical axis, tilted by up to 0.7 rad.
Pose random_pose(sim::Random& random, const Vec3& middle, double near_m, double far_m) {
  const double z = random.uniform(near_m, far_m);
  Pose pose;
  const double rx = random.uniform(-0.7, 0.7), ry = random.uniform(-0.7, 0.7), rz = random.uniform(-3, 3);
  pose.R = sim::rotation(rx, ry, rz);
  const double x = random.uniform(-0.1, 0.1) * z, y = random.uniform(-0.1, 0.1) * z;
  pose.t = add({x, y, z}, scaled(product(pose.R, middle), -1));
  return pose;
}

double difference(const Pose& a, const Pose& b) {
  double worst = 0;
  for (std::size_t i = 0; i < 9; ++i) worst = std::max(worst, std::fabs(a.R[i] - b.R[i]));
  for (std::size_t i = 0; i < 3; ++i) worst = std::max(worst, std::fabs(a.t[i] - b.t[i]));
  return worst;
}

/// Squares of the error in units of the covariance: six where that is honest.
double nees(const Pose& pose, const std::array<double, 36>& covariance, const Pose& truth) {
  SquareMatrix<6> information{};
  EXPECT_TRUE(invert<6>(covariance, information));
  return quadratic<6>(information, step_between(pose, truth));
}

TEST(BundlePose, IsExactFromExactCorners) {
  sim::Random random(1);
  const CameraModel camera = paper_camera();
  for (const Bundle& bundle : {dock(), corner_of_a_box()}) {
    const Vec3 middle = scaled(add(bundle.markers.front().pose.t, bundle.markers.back().pose.t), 0.5);
    for (int i = 0; i < 300; ++i) {
      const Pose truth = random_pose(random, middle, 0.3, 2);
      std::vector<Detection> detections = seen(camera, bundle, truth, 0, random);
      const int read = static_cast<int>(detections.size());
      const BundlePose pose = found(camera, bundle, detections);
      ASSERT_TRUE(pose.has_pose) << i;
      EXPECT_LT(difference(pose.pose, truth), 1e-6) << i;
      EXPECT_EQ(pose.used, read);
      EXPECT_EQ(pose.kept_out, 0);
      EXPECT_LT(pose.uncertainty.error_px, 1e-5);
    }
  }
}

// 2,000 frames: the mean of a chi-square of six lies within 6 +- 0.15 (95 %); what the covariance is enlarged by where
// a frame happens to be noisier than most, makes it a little less.
TEST(BundlePose, ItsCovarianceIsThatOfItsErrors) {
  const CameraModel camera = paper_camera();
  for (const Bundle& bundle : {dock(), corner_of_a_box()}) {
    sim::Random random(2);
    const Vec3 middle = scaled(add(bundle.markers.front().pose.t, bundle.markers.back().pose.t), 0.5);
    double sum = 0;
    int beyond = 0;
    constexpr int kFrames = 2000;
    for (int i = 0; i < kFrames; ++i) {
      const Pose truth = random_pose(random, middle, 0.3, 1);
      const BundlePose pose = found(camera, bundle, seen(camera, bundle, truth, kDeviation_px, random));
      ASSERT_TRUE(pose.has_pose) << i;
      const double squares = nees(pose.pose, pose.uncertainty.covariance, truth);
      sum += squares;
      beyond += squares > 12.59 ? 1 : 0;  // 95 % of a chi-square of six
    }
    EXPECT_GT(sum / kFrames, 5.2);
    EXPECT_LT(sum / kFrames, 6.2);
    EXPECT_GT(beyond, kFrames * 0.02);
    EXPECT_LT(beyond, kFrames * 0.06);
  }
}

TEST(BundlePose, IsThatOfTheOneMarkerThatWasRead) {
  sim::Random random(3);
  const CameraModel camera = paper_camera();
  const Bundle bundle = dock();
  for (int i = 0; i < 200; ++i) {
    const Pose truth = random_pose(random, {}, 0.3, 1);
    const std::vector<Detection> all = seen(camera, bundle, truth, kDeviation_px, random);
    std::vector<Detection> one = {all[static_cast<std::size_t>(i % 5)]};
    add_own_poses(camera, bundle, one);
    ASSERT_TRUE(one[0].has_pose);
    const BundlePose pose = found(camera, bundle, one);
    ASSERT_TRUE(pose.has_pose) << i;
    EXPECT_EQ(pose.used, 1);
    const Pose by_marker = compose(one[0].pose, inverse(bundle.find(*one[0].family, one[0].id)->pose));
    EXPECT_LT(difference(pose.pose, by_marker), 2e-4) << i;
    EXPECT_NEAR(pose.uncertainty.error_px, one[0].pose_uncertainty->error_px, 1e-4);
    EXPECT_EQ(pose.uncertainty.has_other, one[0].pose_uncertainty->has_other) << i;
  }
  EXPECT_FALSE(found(camera, bundle, {}).has_pose);
}

// A marker moved by 8 mm, whichever of the five it is.
TEST(BundlePose, KeepsOutAMarkerOutOfPlace) {
  sim::Random random(4);
  const CameraModel camera = paper_camera();
  const Bundle bundle = dock();
  for (int i = 0; i < 200; ++i) {
    Bundle moved = bundle;
    const double along = random.uniform(0, 2 * kPi);
    Vec3& place = moved.markers[static_cast<std::size_t>(i % 5)].pose.t;
    place = add(place, {0.008 * sim::exact_cos(along), 0.008 * sim::exact_sin(along), 0});
    const Pose truth = random_pose(random, {}, 0.3, 0.8);
    const BundlePose pose = found(camera, bundle, seen(camera, moved, truth, kDeviation_px, random));
    ASSERT_TRUE(pose.has_pose) << i;
    EXPECT_EQ(pose.kept_out, 1) << i;
    EXPECT_EQ(pose.used, 4) << i;
    EXPECT_LT(nees(pose.pose, pose.uncertainty.covariance, truth), 30) << i;
  }
}

TEST(BundlePose, KeepsOutAWrongCorner) {
  sim::Random random(5);
  const CameraModel camera = paper_camera();
  const Bundle bundle = dock();
  for (int i = 0; i < 200; ++i) {
    const Pose truth = random_pose(random, {}, 0.3, 0.8);
    std::vector<Detection> detections = seen(camera, bundle, truth, kDeviation_px, random);
    detections[static_cast<std::size_t>(i % 5)].corners[static_cast<std::size_t>(i % 4)][0] += i % 2 == 0 ? 3 : -3;
    const BundlePose pose = found(camera, bundle, detections);
    ASSERT_TRUE(pose.has_pose) << i;
    EXPECT_EQ(pose.used, 5) << i;
    EXPECT_EQ(pose.corners_kept_out, 1) << i;
    EXPECT_LT(nees(pose.pose, pose.uncertainty.covariance, truth), 30) << i;
  }
}

TEST(BundlePose, KeepsOutWhatIsReadTwice) {
  sim::Random random(6);
  const CameraModel camera = paper_camera();
  const Bundle bundle = dock();
  const Pose truth = random_pose(random, {}, 0.5, 0.5);
  std::vector<Detection> detections = seen(camera, bundle, truth, kDeviation_px, random);
  Detection elsewhere = detections[2];
  for (auto& corner : elsewhere.corners) corner[0] += 40;
  detections.insert(detections.begin(), elsewhere);
  EXPECT_EQ(found(camera, bundle, detections).used, 5);
  EXPECT_EQ(found(camera, bundle, detections).kept_out, 1);
  for (int i = 0; i < 5; ++i) detections.push_back(elsewhere);
  EXPECT_EQ(found(camera, bundle, detections).used, 5);
  EXPECT_EQ(found(camera, bundle, detections).kept_out, 6);
}

// A large marker far away, tilted: by itself it may be tilted the other way. So may a plane of five, and says so; two
// sides of a box do not.
TEST(BundlePose, TellsOfTheOtherPoseOfAPlane) {
  sim::Random random(7);
  const CameraModel camera = paper_camera();
  Pose far;
  far.R = sim::rotation(0.3, 0.1, 0);
  far.t = {0.1, 0.05, 3};
  int doubtful = 0;
  for (int i = 0; i < 20; ++i) {
    const BundlePose flat = found(camera, dock(), seen(camera, dock(), far, kDeviation_px, random));
    ASSERT_TRUE(flat.has_pose);
    ASSERT_TRUE(flat.uncertainty.has_other);
    EXPECT_LE(flat.uncertainty.ambiguity(), 1);
    doubtful += flat.uncertainty.ambiguity() > 0.8 ? 1 : 0;
    // One of the two is the truth, or near it.
    EXPECT_LT(std::min(difference(flat.pose, far), difference(flat.uncertainty.other, far)), 0.5);
    const Vec3 n = column(flat.pose.R, 2), m = column(flat.uncertainty.other.R, 2);
    EXPECT_LT(n[0] * m[0] + n[1] * m[1], 0) << "tilted the other way";
  }
  EXPECT_GT(doubtful, 0);
  const Bundle box = corner_of_a_box();
  far.t = add({0, 0, 3}, scaled(product(far.R, Vec3{5, 2, -0.3}), -1));
  const BundlePose solid = found(camera, box, seen(camera, box, far, kDeviation_px, random));
  ASSERT_TRUE(solid.has_pose);
  EXPECT_FALSE(solid.uncertainty.has_other);
}

// Where markers are known to half a millimetre only, none is kept out for being off by that, and the covariance says
// so.
TEST(BundlePose, WeighsHowExactlyItWasSurveyed) {
  sim::Random random(8);
  const CameraModel camera = paper_camera();
  Bundle bundle = dock();
  Bundle crooked = bundle;
  for (BundleMarker& marker : crooked.markers) {
    for (double& value : marker.pose.t) value += 0.0005 * normal(random);
  }
  const Pose truth = random_pose(random, {}, 0.4, 0.4);
  const std::vector<Detection> detections = seen(camera, crooked, truth, 0.02, random);
  const BundlePose exact = found(camera, crooked, detections);
  bundle.deviation_m = 0.0005;
  const BundlePose lenient = found(camera, bundle, detections);
  ASSERT_TRUE(exact.has_pose && lenient.has_pose);
  EXPECT_GT(lenient.uncertainty.covariance[14], 5 * exact.uncertainty.covariance[14]);
  EXPECT_EQ(lenient.used, 5);
  EXPECT_EQ(lenient.corners_kept_out, 0);
  EXPECT_LT(nees(lenient.pose, lenient.uncertainty.covariance, truth), 30);
}

// The same bits under every compiler: when they change, the commit says why. And nothing is allocated in between.
TEST(BundlePose, HasTheBitsItHad) {
  sim::Random random(9);
  const CameraModel camera = paper_camera();
  u64 digest = 0;
  const auto mix = [&digest](double value) {
    u64 bits = 0;
    std::memcpy(&bits, &value, sizeof bits);
    digest = digest * 31 + bits;
  };
  const Bundle bundle = dock();
  Bundle moved = bundle;
  moved.markers[2].pose.t[0] += 0.01;
  BundlePoser poser(bundle);
  BundlePose pose;
  for (int i = 0; i < 20; ++i) {
    const Pose truth = random_pose(random, {}, 0.3, 1);
    std::vector<Detection> detections = seen(camera, i % 2 == 0 ? bundle : moved, truth, kDeviation_px, random);
    add_own_poses(camera, bundle, detections);
    const std::size_t before = test::allocations();
    poser.find(camera, detections, kDeviation_px, pose);
    EXPECT_EQ(test::allocations(), before) << "find allocates";
    EXPECT_EQ(pose.kept_out, i % 2);
    for (const double value : pose.pose.R) mix(value);
    for (const double value : pose.pose.t) mix(value);
    for (const double value : pose.uncertainty.covariance) mix(value);
    for (const double value : pose.uncertainty.other.t) mix(value);
  }
  EXPECT_EQ(digest, 0x69658de05e76c7bbu) << std::hex << "0x" << digest;
}

}  // namespace
}  // namespace berth
