// Poses over time against motions that are known: the right one of two, no lag, no hidden loss.
#include "berth/pose_filter.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "berth/error.hpp"
#include "sim/geometry.hpp"
#include "sim/random.hpp"
#include "support/docking_approach.hpp"
#include "support/noisy_corners.hpp"
#include "target/marker_pose.hpp"
#include "target/symmetric.hpp"

namespace berth {
namespace {

using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

constexpr double kSide_m = 0.1, kNoise_px = 0.15;
constexpr std::int64_t kFrame_ns = 1'000'000'000 / 70;

PoseFilterConfig config() {
  PoseFilterConfig config;
  config.camera = paper_camera();
  config.marker_size_m = kSide_m;
  config.corner_deviation_px = kNoise_px;
  return config;
}

/// What a detector with that noise says of a marker there.
Detection seen(const Pose& truth, sim::Random& random, double noise_px = kNoise_px) {
  const CameraModel camera = paper_camera();
  Detection marker;
  marker.corners = with_noise(seen_corners(camera, truth, kSide_m), noise_px, random);
  marker.has_pose =
      marker_pose(camera, kSide_m, kNoise_px, marker.corners, marker.pose, marker.pose_uncertainty.emplace());
  return marker;
}

using test::Approach;

double angle(const Pose& a, const Pose& b) {
  const auto step = step_between(a, b);
  return length({step[3], step[4], step[5]});
}

TEST(PoseFilter, ChoosesTheRightOneOfTwoPoses) {
  int alone_wrong = 0, sure = 0, sure_wrong = 0, frames = 0;
  double alone_squares = 0, squares = 0;
  for (u64 seed = 0; seed < 6; ++seed) {
    const Approach approach(seed);
    sim::Random random(seed + 100);
    PoseFilter filter(config());
    for (int i = 0; i < Approach::kFrames; ++i) {
      const Pose truth = approach.pose(i);
      const Detection marker = seen(truth, random);
      ASSERT_TRUE(marker.has_pose) << i;
      const FilteredPose& pose = filter.update(i * kFrame_ns, &marker);
      ASSERT_TRUE(pose.has_pose);
      EXPECT_FALSE(pose.outlier);
      ++frames;
      const double alone = angle(marker.pose, truth), filtered = angle(pose.pose, truth);
      alone_squares += alone * alone;
      squares += filtered * filtered;
      // Wrong: nearer to the other solution, and further from the truth than its deviation says.
      const PoseUncertainty& uncertainty = *marker.pose_uncertainty;
      if (uncertainty.has_other) {
        const double other = angle(uncertainty.other, truth);
        alone_wrong += other < alone && alone > 0.1;
        const Pose& bad = other > alone ? uncertainty.other : marker.pose;
        const double deviation = std::sqrt(pose.covariance[21] + pose.covariance[28] + pose.covariance[35]);
        sure_wrong += pose.sure && angle(bad, pose.pose) < filtered && filtered > 4 * deviation;
      }
      sure += pose.sure;
    }
  }
  EXPECT_GT(alone_wrong, 5);  // or there was nothing to choose
  EXPECT_EQ(sure_wrong, 0);
  EXPECT_GT(sure, frames * 97 / 100);
  EXPECT_LT(squares, alone_squares / 6);
}

TEST(PoseFilter, ItsCovarianceIsThatOfItsErrors) {
  // Of motions as the filter takes them to be: velocities that walk at random.
  const PoseFilterConfig wanted = config();
  std::array<double, 6> squares{};
  double all = 0;
  int frames = 0;
  for (u64 seed = 0; seed < 20; ++seed) {
    sim::Random random(seed);
    Pose truth = {sim::rotation(0.5, 0.2, 0.1), {0.05, 0, 0.7}};
    std::array<double, 6> velocity{};
    PoseFilter filter(wanted);
    for (int i = 0; i < 70; ++i) {
      const Detection marker = seen(truth, random);
      const FilteredPose& pose = filter.update(i * kFrame_ns, &marker);
      SquareMatrix<6> information{};
      ASSERT_TRUE(invert<6>(pose.covariance, information));
      const auto off = step_between(pose.pose, truth);
      if (i % 10 == 9) {
        all += quadratic<6>(information, off);
        for (std::size_t k = 0; k < 6; ++k) squares[k] += off[k] * off[k] / pose.covariance[k * 7];
        ++frames;
      }
      std::array<double, 6> step{};
      const double seconds = static_cast<double>(kFrame_ns) * 1e-9;
      for (std::size_t k = 0; k < 6; ++k) {
        const double gained =
            (k < 3 ? wanted.acceleration : wanted.angular_acceleration) * std::sqrt(seconds) * normal(random);
        step[k] = (velocity[k] + gained / 2) * seconds;
        velocity[k] += gained;
      }
      truth = moved(truth, step);
    }
  }
  // 140 frames of 6 degrees of freedom, nearly independent: 840 ± 41, of an axis 140 ± 17.
  EXPECT_NEAR(all / frames, 6, 0.9);
  for (std::size_t k = 0; k < 6; ++k) EXPECT_NEAR(squares[k] / frames, 1, 0.4) << k;
}

TEST(PoseFilter, FollowsWithoutLagAndForetells) {
  PoseFilter filter(config());
  sim::Random random(1);
  const auto truth = [](double seconds) {
    return Pose{sim::rotation(0.5, 0.2 + 0.3 * seconds, 0), {0.1 * seconds - 0.05, 0.02, 0.8 - 0.2 * seconds}};
  };
  for (int i = 0; i < 70; ++i) {
    const Detection marker = seen(truth(i / 70.0), random, 0.02);
    filter.update(i * 1'000'000'000LL / 70, &marker);
  }
  const FilteredPose later = filter.foretell(1'050'000'000);
  ASSERT_TRUE(later.has_pose);
  EXPECT_FALSE(later.measured);
  EXPECT_NEAR(later.age_s, 0.0643, 1e-3);
  const auto off = step_between(later.pose, truth(1.05));
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(off[k], 0, 0.002) << k;
  for (std::size_t k = 3; k < 6; ++k) EXPECT_NEAR(off[k], 0, 0.02) << k;
  EXPECT_NEAR(later.velocity[0], 0.1, 0.02);
  EXPECT_NEAR(later.velocity[2], -0.2, 0.04);
  EXPECT_FALSE(filter.foretell(2'000'000'000).has_pose);
}

TEST(PoseFilter, SaysWhatItDidNotSee) {
  PoseFilter filter(config());
  sim::Random random(1);
  const Pose truth = {sim::rotation(0.4, 0, 0), {0, 0, 0.6}};
  EXPECT_FALSE(filter.update(0, nullptr).has_pose);
  std::int64_t now = 0;
  for (int i = 0; i < 20; ++i) {
    const Detection marker = seen(truth, random);
    EXPECT_TRUE(filter.update(now += kFrame_ns, &marker).measured);
  }
  const double before = filter.update(now += kFrame_ns, nullptr).covariance[14];
  const FilteredPose missing = filter.update(now += kFrame_ns, nullptr);
  EXPECT_TRUE(missing.has_pose);
  EXPECT_FALSE(missing.measured);
  EXPECT_NEAR(missing.age_s, 2e-9 * static_cast<double>(kFrame_ns), 1e-9);
  EXPECT_GT(missing.covariance[14], before);
  EXPECT_FALSE(filter.update(now + 600'000'000, nullptr).has_pose);
  const Detection again = seen(truth, random);
  EXPECT_TRUE(filter.update(now + 700'000'000, &again).measured);
  const FilteredPose& backwards = filter.update(now + 650'000'000, &again);
  EXPECT_TRUE(backwards.outlier);
  EXPECT_FALSE(backwards.measured);
  EXPECT_FALSE(backwards.has_pose) << "nothing is said of a time that has passed";
  EXPECT_TRUE(filter.foretell(now + 710'000'000).has_pose) << "the track is still there";
}

TEST(PoseFilter, AClockThatWasSetBackBeginsTheTrackAnew) {
  sim::Random random(1);
  const Pose truth = {sim::rotation(0.4, 0, 0), {0, 0, 0.6}};
  const Detection marker = seen(truth, random);
  PoseFilter filter(config());
  std::int64_t now = 100'000'000'000;
  for (int i = 0; i < 20; ++i) filter.update(now += kFrame_ns, &marker);
  // By an hour: at once.
  now -= 3'600'000'000'000;
  const FilteredPose& later = filter.update(now, &marker);
  EXPECT_TRUE(later.measured);
  EXPECT_TRUE(later.jumped);
  EXPECT_EQ(later.time_ns, now);
  for (int i = 0; i < 20; ++i) EXPECT_TRUE(filter.update(now += kFrame_ns, &marker).measured);
  // By 0.4 s: when it stays so.
  now -= 400'000'000;
  int kept_out = 0;
  while (filter.update(now += 1'000'000, &marker).outlier) ++kept_out;
  EXPECT_EQ(kept_out, config().most_outliers);
  EXPECT_EQ(filter.foretell(now).time_ns, now);
  EXPECT_TRUE(filter.foretell(now).has_pose);
}

TEST(PoseFilter, KeepsOutliersOutAndBeginsAnewWhenTheyStay) {
  PoseFilter filter(config());
  sim::Random random(1);
  std::int64_t now = 0;
  const Pose truth = {sim::rotation(0.4, 0, 0), {0, 0, 0.6}};
  const Pose elsewhere = {sim::rotation(0.4, 0, 0), {0.1, 0, 0.5}};
  for (int i = 0; i < 20; ++i) {
    const Detection marker = seen(truth, random);
    filter.update(now += kFrame_ns, &marker);
  }
  for (int i = 0; i < config().most_outliers; ++i) {
    const Detection wrong = seen(elsewhere, random);
    const FilteredPose& pose = filter.update(now += kFrame_ns, &wrong);
    EXPECT_TRUE(pose.outlier);
    EXPECT_FALSE(pose.measured);
    EXPECT_LT(length(add(pose.pose.t, scaled(truth.t, -1))), 0.02);
  }
  const Detection wrong = seen(elsewhere, random);
  const FilteredPose& pose = filter.update(now += kFrame_ns, &wrong);
  EXPECT_TRUE(pose.jumped);
  EXPECT_TRUE(pose.measured);
  EXPECT_LT(length(add(pose.pose.t, scaled(elsewhere.t, -1))), 0.02);
}

TEST(PoseFilter, RefusesWhatIsNoNumberAboveNought) {
  PoseFilterConfig wrong = config();
  wrong.marker_size_m = 0;
  EXPECT_THAT([&] { PoseFilter filter(wrong); }, ThrowsMessage<Error>(HasSubstr("marker_size_m")));
  wrong = config();
  wrong.lost_s = -1;
  EXPECT_THAT([&] { PoseFilter filter(wrong); }, ThrowsMessage<Error>(HasSubstr("lost_s")));
}

}  // namespace
}  // namespace berth
