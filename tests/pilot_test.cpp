// The hand-over: when modes change, and that a pilot follows a simulated flight by its marker.
#include "berth/pilot.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <iomanip>
#include <sstream>

#include "berth/error.hpp"
#include "flight_run.hpp"
#include "navset/flight.hpp"
#include "pilot/mode_switch.hpp"
#include "support/command_run.hpp"

namespace berth {
namespace {

using ::testing::HasSubstr;
using ::testing::StartsWith;
using ::testing::ThrowsMessage;

const std::string kTiny = std::string(BERTH_SOURCE_DIR) + "/training/tests/data/tiny.berthnet";

ModeSwitch::Evidence marker_at(double range_m) {
  ModeSwitch::Evidence evidence;
  evidence.looked_for_marker = true;
  evidence.marker_range_m = range_m;
  return evidence;
}

ModeSwitch::Evidence nothing() {
  ModeSwitch::Evidence evidence;
  evidence.looked_for_marker = evidence.looked_for_target = true;
  return evidence;
}

/// No marker; the target, where it was last or elsewhere.
ModeSwitch::Evidence target(bool followed) {
  ModeSwitch::Evidence evidence = nothing();
  evidence.sighted = true;
  evidence.followed = followed;
  return evidence;
}

class Modes : public ::testing::Test {
 protected:
  /// The mode after so many frames of the same evidence.
  Mode after(int frames, const ModeSwitch::Evidence& evidence) {
    for (int i = 0; i < frames; ++i) change_ = modes_.update(evidence);
    return modes_.mode();
  }
  ModeSwitch modes_{HandOver{}};
  std::string change_;
};

TEST_F(Modes, NavigationBeginsWithASighting) {
  EXPECT_EQ(after(10, nothing()), Mode::search);
  EXPECT_EQ(after(1, target(true)), Mode::navigation);
  EXPECT_THAT(change_, HasSubstr("target is seen"));
  EXPECT_EQ(after(1, target(true)), Mode::navigation);
  EXPECT_EQ(change_, "");
}

TEST(ModeSwitch, MayAskForMoreSightingsAtOnePlace) {
  HandOver rules;
  rules.sighting_frames = 2;
  ModeSwitch modes(rules);
  for (int i = 0; i < 10; ++i) {
    modes.update(target(false));
    EXPECT_EQ(modes.mode(), Mode::search) << "each somewhere else";
  }
  modes.update(target(true));
  EXPECT_EQ(modes.mode(), Mode::navigation);
}

TEST_F(Modes, NavigationEndsAfterFiveFramesWithoutATarget) {
  after(2, target(true));
  EXPECT_EQ(after(4, nothing()), Mode::navigation);
  EXPECT_EQ(after(1, target(false)), Mode::navigation) << "seen in between: counted from the beginning";
  EXPECT_EQ(after(4, nothing()), Mode::navigation);
  EXPECT_EQ(after(1, nothing()), Mode::search);
}

TEST_F(Modes, DockingTakesThreeReadingsOfANearMarkerRunning) {
  EXPECT_EQ(after(50, marker_at(1.51)), Mode::search) << "read, but not near";
  EXPECT_EQ(after(2, marker_at(1.49)), Mode::search);
  EXPECT_EQ(after(1, nothing()), Mode::search);
  EXPECT_EQ(after(2, marker_at(1.49)), Mode::search);
  EXPECT_EQ(after(1, marker_at(1.49)), Mode::docking);
}

TEST_F(Modes, DockingHasHysteresisInRange) {
  after(3, marker_at(1.4));
  EXPECT_EQ(after(50, marker_at(1.69)), Mode::docking) << "beyond where it began, within where it ends";
  EXPECT_EQ(after(4, marker_at(1.71)), Mode::docking);
  EXPECT_EQ(after(1, marker_at(1.71)), Mode::navigation);
  EXPECT_THAT(change_, HasSubstr("far"));
}

TEST_F(Modes, ALostMarkerGivesBackToTheNetworkOrToTheSearch) {
  after(3, marker_at(1));
  EXPECT_EQ(after(4, target(true)), Mode::docking);
  EXPECT_EQ(after(1, target(true)), Mode::navigation);
  after(3, marker_at(1));
  EXPECT_EQ(after(4, nothing()), Mode::docking);
  EXPECT_EQ(after(1, nothing()), Mode::search);
  EXPECT_THAT(change_, HasSubstr("neither"));
}

TEST_F(Modes, WhatWasNotLookedForChangesNothing) {
  after(3, marker_at(1));
  ModeSwitch::Evidence only_target;
  only_target.looked_for_target = true;
  EXPECT_EQ(after(50, only_target), Mode::docking);
}

PilotConfig flight_config() {
  PilotConfig config = cli::flight_pilot(kTiny);
  config.navigator.threshold_q15 = 32769;  // it knows nothing: let it say nothing
  config.navigator.keep_threshold_q15 = 32769;
  config.navigator.search_threshold_q15 = 32769;
  return config;
}

TEST(Flight, HasTheMarkerWhereItsTruthSays) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  const PilotConfig config = flight_config();
  Detector detector(*backend, 640, 480, config.detector);
  const navset::Flight flight(3, 100);
  for (const int index : {70, 85, 99}) {
    const navset::FlightFrame frame = flight.frame(index);
    const FrameResult& result = detector.detect(frame.image.view());
    ASSERT_EQ(result.detections.size(), 1u) << index;
    const Detection& marker = result.detections[0];
    EXPECT_EQ(marker.id, navset::kDockMarker);
    for (std::size_t i = 0; i < 9; ++i) EXPECT_NEAR(marker.pose.R[i], frame.marker.R[i], 0.05) << index;
    for (std::size_t i = 0; i < 3; ++i) {
      EXPECT_NEAR(marker.pose.t[i], frame.marker.t[i], 0.01 * frame.marker_range_m) << index;
    }
  }
}

TEST(Flight, IsAFunctionOfItsSeed) {
  const navset::FlightFrame one = navset::Flight(5, 50).frame(20);
  const navset::FlightFrame same = navset::Flight(5, 50).frame(20);
  const navset::FlightFrame other = navset::Flight(6, 50).frame(20);
  const auto pixels = [](const navset::FlightFrame& frame) {
    const View2D<const u8> view = frame.image.view();
    return std::vector<u8>(view.data, view.data + 640 * 480);
  };
  EXPECT_EQ(pixels(one), pixels(same));
  EXPECT_NE(pixels(one), pixels(other));
}

TEST(Pilot, DocksLosesAndFindsAgain) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  Pilot pilot(*backend, *backend, 640, 480, flight_config());
  const navset::Flight flight(3, 100);
  const auto fly = [&](int index) {
    const navset::FlightFrame truth = flight.frame(index);
    const PilotFrame& frame = pilot.look(truth.image.view());
    if (frame.mode == Mode::docking) {
      EXPECT_TRUE(frame.has_position && frame.from_marker);
      for (std::size_t i = 0; i < 3; ++i) EXPECT_NEAR(frame.position_m[i], truth.target.t[i], 0.03) << index;
    }
    return frame.mode;
  };
  std::vector<Mode> modes;
  for (int index = 60; index < 64; ++index) modes.push_back(fly(index));
  EXPECT_EQ(modes, (std::vector<Mode>{Mode::search, Mode::search, Mode::docking, Mode::docking}));
  const GrayImage dark(640, 480);
  for (int i = 0; i < 4; ++i) {
    const PilotFrame& frame = pilot.look(dark.view());
    EXPECT_EQ(frame.mode, Mode::docking);
    EXPECT_FALSE(frame.has_position) << "never a position of an earlier frame";
    EXPECT_TRUE(frame.looked_for_target) << "the network helps out";
  }
  EXPECT_EQ(pilot.look(dark.view()).mode, Mode::search);
  modes.clear();
  for (int index = 64; index < 72; ++index) modes.push_back(fly(index));
  EXPECT_EQ(modes.back(), Mode::docking);
}

TEST(Pilot, RefusesAConfigurationThatCannotDock) {
  const std::unique_ptr<Backend> backend = open_backend("simd");
  const auto made_with = [&](void (*change)(PilotConfig&)) {
    PilotConfig config = flight_config();
    change(config);
    return [&backend, config] { Pilot(*backend, *backend, 640, 480, config); };
  };
  EXPECT_THAT(made_with([](PilotConfig& c) { c.detector.camera.reset(); }), ThrowsMessage<Error>(HasSubstr("camera")));
  EXPECT_THAT(made_with([](PilotConfig& c) { c.detector.marker_size_m = 0; }), ThrowsMessage<Error>(HasSubstr("size")));
  EXPECT_THAT(made_with([](PilotConfig& c) { c.hand_over.navigation_m = 1; }),
              ThrowsMessage<Error>(HasSubstr("navigation_m")));
  EXPECT_THAT(made_with([](PilotConfig& c) { c.hand_over.lost_frames = 0; }),
              ThrowsMessage<Error>(HasSubstr("0 frames")));
  EXPECT_THAT(made_with([](PilotConfig& c) { c.navigator.network = "nowhere.berthnet"; }),
              ThrowsMessage<Error>(HasSubstr("nowhere.berthnet")));
}

TEST(CliFlight, DrawsOneFlight) {
  const test::ScratchFolder folder;
  const test::CommandRun run = test::run_berth(
      {"flight", "--network", kTiny, "--seed", "3", "--frames", "24", "--out", folder / "one", "--backend", "simd"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("docking: the marker is read and near"));
  EXPECT_THAT(run.out, HasSubstr("\ndocked; longest gap"));
  EXPECT_THAT(test::text_of(folder / "one/flight.svg"), StartsWith("<svg "));
  const auto log = test::CommandRun::json_lines(test::text_of(folder / "one/flight.jsonl"));
  ASSERT_EQ(log.size(), 1u);
  EXPECT_TRUE(log[0]["docked"].get<bool>());
  EXPECT_LT(log[0]["marker"]["off"].get<double>(), 0.02);
}

TEST(CliFlight, NavigatesByTheNetworkThatComesWithBerth) {
  const test::ScratchFolder folder;
  const test::CommandRun run =
      test::run_berth({"flight", "--seed", "3", "--frames", "24", "--out", folder / "one", "--backend", "simd"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("navigation: the target is seen"));
  EXPECT_THAT(run.out, HasSubstr("longest gap 0 frames, 0 frames with something else"));
  const auto log = test::CommandRun::json_lines(test::text_of(folder / "one/flight.jsonl"));
  ASSERT_EQ(log.size(), 1u);
  EXPECT_GT(log[0]["network"]["frames"].get<int>(), 5);
  EXPECT_LT(log[0]["network"]["off"].get<double>(), 0.2);
}

TEST(CliFlight, IsPlayedInRealTimeWithTheNetworkBeside) {
  const test::ScratchFolder folder;
  const test::CommandRun run = test::run_berth({"flight", "--network", kTiny, "--seed", "3", "--frames", "9", "--fps",
                                                "10", "--deadline", "9000", "--nav-backend", "cpu", "--nav-frames", "2",
                                                "--out", folder / "one", "--backend", "simd"});
  EXPECT_THAT(run.out, HasSubstr("network     on cpu, its word counts 2 frames (200 ms) after the one it is given"));
  EXPECT_THAT(run.out, HasSubstr("the network at work:  later than 9000 ms: 0 of "));
  EXPECT_THAT(run.out, HasSubstr("looks of the network"));
  const auto log = test::CommandRun::json_lines(test::text_of(folder / "one/flight.jsonl"));
  ASSERT_EQ(log.size(), 1u);
  const auto& played = log[0]["played"];
  EXPECT_EQ(played["offered"], 9);
  EXPECT_EQ(played["delivered"], log[0]["frames"]);
  EXPECT_GE(played["network"]["looks"], 1);
  EXPECT_EQ(played["network"]["backend"], "cpu");
  EXPECT_EQ(played["network"]["at_work"]["frames"].get<int>() + played["network"]["at_rest"]["frames"].get<int>(),
            played["delivered"].get<int>());
  EXPECT_THAT(test::run_berth({"flight", "--fps", "10", "--count", "2"}).err, HasSubstr("one flight"));
}

TEST(CliFlight, GoesOnWithACampaign) {
  const test::ScratchFolder folder;
  const auto fly = [&](const char* count) {
    return test::run_berth({"flight", "--network", kTiny, "--count", count, "--jobs", "2", "--frames", "6", "--out",
                            folder / "many", "--backend", "simd"});
  };
  EXPECT_THAT(fly("2").out, HasSubstr("| 2 |"));
  // Cut off in the middle of a line, as by a loss of power.
  const std::string whole = test::text_of(folder / "many/flights.jsonl");
  folder.write("many/flights.jsonl", whole.substr(0, whole.size() - 10));
  EXPECT_THAT(fly("3").out, HasSubstr("| 3 |"));
  EXPECT_EQ(test::CommandRun::json_lines(test::text_of(folder / "many/flights.jsonl")).size(), 3u);
}

TEST(CliFlight, CountsFalseAlarmsWithoutATarget) {
  const test::ScratchFolder folder;
  const test::CommandRun run = test::run_berth(
      {"flight", "--network", kTiny, "--empty", "--frames", "6", "--out", folder / "empty", "--backend", "simd"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const auto log = test::CommandRun::json_lines(test::text_of(folder / "empty/empty.jsonl"));
  ASSERT_EQ(log.size(), 1u);
  EXPECT_FALSE(log[0]["docked"].get<bool>());
  EXPECT_EQ(log[0]["marker"]["frames"].get<int>(), 0);
  // The tiny network sees a target in every noise: whatever it saw is counted.
  std::ostringstream row;
  row << "| 1 | 6 | " << std::fixed << std::setprecision(2) << log[0]["sightings"].get<int>() * 1000 / 6.0 << " |";
  EXPECT_THAT(run.out, HasSubstr(row.str()));
}

}  // namespace
}  // namespace berth
