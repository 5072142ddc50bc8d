// Frames of two stations become moments by their times alone; and what a moment's one or two views say of the robot.
#include "berth/station_pairing.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "berth/error.hpp"
#include "sim/geometry.hpp"
#include "support/counted_allocations.hpp"
#include "support/noisy_corners.hpp"
#include "target/marker_pose.hpp"

namespace berth {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;

constexpr std::int64_t kMs = 1'000'000;
constexpr StationSide kRobot = StationSide::robot, kDock = StationSide::dock;

FrameStamp at(std::int64_t ns, const char* clock = "ptp") {
  FrameStamp stamp;
  stamp.mid_exposure_ns = ns;
  stamp.clock = clock;
  return stamp;
}

/// "R10D11" for a pair, "R10" or "D11" alone, in ms, of all that is certain.
std::vector<std::string> taken(StationPairing& pairing) {
  std::vector<std::string> all;
  StationMoment moment;
  while (pairing.next(moment)) {
    std::string text;
    for (std::size_t side = 0; side < kStationSides; ++side) {
      if (!moment.came[side]) continue;
      text += (side == 0 ? "R" : "D") + std::to_string(moment.frames[side].stamp.mid_exposure_ns / kMs);
    }
    all.push_back(text);
  }
  return all;
}

struct Arrival {
  StationSide side;
  std::int64_t ms;
};

std::vector<std::string> moments_of(const std::vector<Arrival>& arrivals, std::int64_t largest_ms = 2) {
  StationPairing pairing({largest_ms * kMs, 64});
  std::vector<std::string> all;
  for (const Arrival& arrival : arrivals) {
    pairing.push(arrival.side, at(arrival.ms * kMs), nullptr);
    for (std::string& text : taken(pairing)) all.push_back(std::move(text));
  }
  pairing.end(kRobot);
  pairing.end(kDock);
  for (std::string& text : taken(pairing)) all.push_back(std::move(text));
  return all;
}

TEST(StationPairing, PairsByTime) {
  EXPECT_THAT(moments_of({{kRobot, 10}, {kDock, 11}, {kRobot, 20}, {kDock, 25}, {kRobot, 30}, {kDock, 28}}),
              ElementsAre("R10D11", "R20", "D25", "R30D28"));
  // To the last ns, and ties.
  EXPECT_THAT(moments_of({{kRobot, 10}, {kDock, 12}, {kRobot, 20}, {kDock, 20}, {kRobot, 30}, {kDock, 33}}),
              ElementsAre("R10D12", "R20D20", "R30", "D33"));
}

TEST(StationPairing, DoesNotDependOnTheOrderOfArrival) {
  std::vector<Arrival> robot, dock;
  // Of unlike rates, with gaps.
  for (int i = 0; i < 40; ++i) {
    if (i % 7 != 3) robot.push_back({kRobot, 10 * i});
    if (i % 5 != 1) dock.push_back({kDock, 12 * i + 1});
  }
  std::vector<Arrival> in_turn = robot;
  in_turn.insert(in_turn.end(), dock.begin(), dock.end());
  const std::vector<std::string> expected = moments_of(in_turn);
  EXPECT_GT(std::count_if(expected.begin(), expected.end(), [](const auto& m) { return m.size() > 4; }), 5);
  sim::Random random(1);
  for (int round = 0; round < 20; ++round) {
    std::vector<Arrival> mixed;
    std::size_t r = 0, d = 0;
    while (r < robot.size() || d < dock.size()) {
      const bool from_robot = d == dock.size() || (r < robot.size() && random.uniform(0, 1) < 0.5);
      mixed.push_back(from_robot ? robot[r++] : dock[d++]);
    }
    EXPECT_EQ(moments_of(mixed), expected) << "round " << round;
  }
}

TEST(StationPairing, WaitsUntilItIsCertain) {
  StationPairing pairing({2 * kMs, 8});
  pairing.push(kRobot, at(10 * kMs), nullptr);
  EXPECT_THAT(taken(pairing), ElementsAre()) << "the dock's may come yet";
  pairing.push(kDock, at(9 * kMs), nullptr);
  EXPECT_THAT(taken(pairing), ElementsAre("R10D9"));
  pairing.push(kRobot, at(11 * kMs), nullptr);
  EXPECT_THAT(taken(pairing), ElementsAre());
  pairing.push(kDock, at(20 * kMs), nullptr);
  EXPECT_THAT(taken(pairing), ElementsAre("R11"));
  pairing.end(kRobot);
  EXPECT_THAT(taken(pairing), ElementsAre("D20"));
  pairing.push(kDock, at(30 * kMs), nullptr);
  EXPECT_THAT(taken(pairing), ElementsAre("D30")) << "the robot's station is lost";
}

TEST(StationPairing, WaitsNoLongerThanItMay) {
  StationPairing pairing({2 * kMs, 8});
  pairing.push(kRobot, at(10 * kMs), nullptr, 100);
  pairing.push(kRobot, at(20 * kMs), nullptr, 200);
  pairing.release(150);
  EXPECT_THAT(taken(pairing), ElementsAre("R10"));
  // Its partner comes late.
  pairing.push(kDock, at(10 * kMs), nullptr, 210);
  EXPECT_THAT(taken(pairing), ElementsAre("D10"));
  pairing.push(kDock, at(21 * kMs), nullptr, 220);
  EXPECT_THAT(taken(pairing), ElementsAre("R20D21"));
}

TEST(StationPairing, CountsEveryFrame) {
  StationPairing pairing({2 * kMs, 2});
  for (const int ms : {10, 20, 20, 15, 30, 40}) pairing.push(kRobot, at(ms * kMs), nullptr);
  EXPECT_TRUE(pairing.is_full(kRobot));
  EXPECT_FALSE(pairing.is_full(kDock));
  EXPECT_EQ(pairing.counts(kRobot).waiting, 2u);
  pairing.push(kDock, at(40 * kMs), nullptr);
  EXPECT_THAT(taken(pairing), ElementsAre("R30", "R40D40"));
  const StationCounts counts = pairing.counts(kRobot);
  EXPECT_EQ(counts.paired, 1u);
  EXPECT_EQ(counts.alone, 1u);
  EXPECT_EQ(counts.out_of_order, 2u);
  EXPECT_EQ(counts.dropped, 2u);
  EXPECT_EQ(counts.waiting, 0u);
  EXPECT_EQ(pairing.counts(kDock).paired, 1u);
}

std::string refusal(StationPairing& pairing, StationSide side, const char* clock) {
  try {
    pairing.push(side, at(0, clock), nullptr);
  } catch (const Error& error) {
    return error.what();
  }
  return "";
}

// A recording's own names of clocks end with it, while its last frames still wait.
TEST(StationPairing, KeepsTheClocksName) {
  StationPairing pairing({});
  std::string name = "ptp";
  pairing.push(kRobot, at(10 * kMs, name.c_str()), nullptr);
  pairing.end(kDock);
  name = "xyz";
  StationMoment moment;
  ASSERT_TRUE(pairing.next(moment));
  EXPECT_STREQ(moment.frames[0].stamp.clock, "ptp");
}

TEST(StationPairing, RefusesClocksThatAreNotOne) {
  StationPairing pairing({});
  EXPECT_THAT(refusal(pairing, kRobot, "none"), HasSubstr("station robot: its frames have no times"));
  EXPECT_THAT(refusal(pairing, kDock, "camera"), HasSubstr("time=ptp"));
  EXPECT_EQ(refusal(pairing, kRobot, "ptp"), "");
  const std::string ptp = "ptp";
  EXPECT_EQ(refusal(pairing, kDock, ptp.c_str()), "") << "by its name";
  EXPECT_THAT(refusal(pairing, kDock, "monotonic"),
              HasSubstr("station dock: its frames' times are on the clock 'monotonic', the other station's on 'ptp'"));
  EXPECT_THROW(StationPairing({-1, 8}), Error);
  EXPECT_THROW(StationPairing({0, 0}), Error);
}

constexpr double kSide_m = 0.08, kNoise_px = 0.1;

struct Scene {
  StationPair pair;
  Pose robot;
  StationMoment moment;
};

/// Both see; the robot's frame is its camera's, the dock's its marker's.
Scene scene(sim::Random& random) {
  Scene scene;
  const Pose back = {sim::rotation(0, radians(180), 0), {0.12, 0, 0}};
  const Pose to_robot = {sim::rotation(random.uniform(-0.3, 0.3), random.uniform(-0.3, 0.3), 0), {0, 0, 0.5}};
  scene.robot = inverse(to_robot);
  scene.pair.dock.camera = scene.pair.dock.marker = back;
  const Pose to_dock = compose(inverse(back), compose(scene.robot, back));
  for (const StationSide side : {kRobot, kDock}) {
    Station& station = side == kRobot ? scene.pair.robot : scene.pair.dock;
    station.lens = paper_camera();
    station.marker_size_m = kSide_m;
    station.corner_deviation_px = kNoise_px;
    StationFrame& frame = scene.moment.frames[static_cast<std::size_t>(side)];
    Detection& marker = frame.marker;
    marker.corners =
        with_noise(seen_corners(station.lens, side == kRobot ? to_robot : to_dock, kSide_m), kNoise_px, random);
    marker.has_pose =
        marker_pose(station.lens, kSide_m, kNoise_px, marker.corners, marker.pose, marker.pose_uncertainty.emplace());
    frame.sees = true;
  }
  scene.moment.came = {true, true};
  return scene;
}

TEST(Fuse, SaysWhichStationItWas) {
  sim::Random random(2);
  Scene both = scene(random);
  const FusedPose fused = fuse(both.pair, both.moment);
  ASSERT_TRUE(fused.has_pose);
  EXPECT_THAT(fused.used, ElementsAre(true, true));
  EXPECT_FALSE(fused.disagree);
  EXPECT_LT(mahalanobis(fused.robot.uncertainty.covariance, step_between(fused.robot.pose, both.robot)), 28);
  EXPECT_TRUE(fuse(both.pair, both.moment, 1e-6).disagree) << "above the gate";

  Scene blind = both;
  blind.moment.frames[0].sees = false;
  EXPECT_THAT(fuse(blind.pair, blind.moment).used, ElementsAre(false, true));
  blind.moment.came[1] = false;
  EXPECT_FALSE(fuse(blind.pair, blind.moment).has_pose);
  EXPECT_THAT(fuse(blind.pair, blind.moment).used, ElementsAre(false, false));
  Scene misread = both;
  misread.moment.frames[1].marker.has_pose = false;
  const FusedPose alone = fuse(misread.pair, misread.moment);
  EXPECT_TRUE(alone.has_pose);
  EXPECT_THAT(alone.used, ElementsAre(true, false));
}

TEST(Fuse, TellsStationsThatDoNotFitTogether) {
  sim::Random random(3);
  Scene bent = scene(random);
  bent.pair.dock.camera = compose(bent.pair.dock.camera, Pose{sim::rotation(0, 0, radians(5)), {}});
  const FusedPose fused = fuse(bent.pair, bent.moment);
  EXPECT_TRUE(fused.disagree);
}

TEST(StationPairing, TakesNoMemoryOnTheWay) {
  sim::Random random(4);
  const Scene one = scene(random);
  StationPairing pairing({kMs, 8});
  StationMoment moment;
  const std::size_t before = test::allocations();
  int fused = 0;
  for (int i = 0; i < 100; ++i) {
    pairing.push(kRobot, at(i * 10 * kMs), &one.moment.frames[0].marker, i);
    pairing.push(kDock, at(i * 10 * kMs), &one.moment.frames[1].marker, i);
    while (pairing.next(moment)) fused += fuse(one.pair, moment).has_pose ? 1 : 0;
  }
  EXPECT_EQ(test::allocations() - before, 0u);
  EXPECT_EQ(fused, 100);
}

}  // namespace
}  // namespace berth
