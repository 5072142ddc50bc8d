// berth stations: two simulated cameras that see one flight from both its ends, whose truth is known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "mount.hpp"
#include "pose_algebra.hpp"
#include "support/command_run.hpp"
#include "support/noisy_corners.hpp"

namespace berth {
namespace {

using nlohmann::json;
using test::CommandRun;
using test::run_berth;
using test::ScratchFolder;
using test::text_of;
using testing::HasSubstr;

const std::string kScenarios = BERTH_SOURCE_DIR "/scenarios/";
const std::string kRobotPart = "source = \"sim:" + kScenarios +
                               "stations-robot.toml\"\nmarker = \"tag36h11:7\"\nsize = 0.08\n"
                               "corners = \"photometric\"\ncamera-at = \"0,0,0,0,0,0\"\nmarker-at = \"0,0,0,0,0,0\"\n";
const std::string kDockPart =
    "source = \"sim:" + kScenarios +
    "stations-dock.toml\"\nmarker = \"tag36h11:9\"\nsize = 0.08\n"
    "corners = \"photometric\"\ncamera-at = \"0,0.12,0,0,0,0\"\nmarker-at = \"0,-0.12,0,0,0,0\"\n";

/// `frames`: of each station's.
struct File {
  std::string top, robot, dock;
  int robot_frames = 8, dock_frames = 8;
};

CommandRun run_stations(const ScratchFolder& folder, const File& file, const std::vector<std::string>& more = {}) {
  const std::string text = file.top + "[robot]\n" + kRobotPart + "max-frames = " + std::to_string(file.robot_frames) +
                           "\n" + file.robot + "[dock]\n" + kDockPart +
                           "max-frames = " + std::to_string(file.dock_frames) + "\n" + file.dock;
  std::vector<std::string> arguments = {"stations", folder.write("stations.toml", text)};
  arguments.insert(arguments.end(), more.begin(), more.end());
  return run_berth(arguments);
}

Pose pose_of(const json& pose) {
  Pose result;
  result.R = pose.at("R");
  result.t = pose.at("t");
  return result;
}

/// Robot frame to dock frame, from where the robot's camera truly sees the dock's marker.
Pose robot_by(const json& truth_marker) {
  return compose(cli::mounted_marker({}),
                 compose(inverse(pose_of(truth_marker.at("pose"))), inverse(cli::mounted_camera({}))));
}

TEST(StationRun, FusesBothViewsOfOneFlight) {
  const ScratchFolder folder;
  const std::string robot_log = folder / "robot.jsonl", dock_log = folder / "dock.jsonl";
  const CommandRun run =
      run_stations(folder, {"", "json = \"" + robot_log + "\"\n", "json = \"" + dock_log + "\"\n"}, {"--json", "-"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("both   8 moments: 8 by both"));
  EXPECT_THAT(run.err, HasSubstr("robot  8 frames, 8 with markers"));
  const std::vector<json> moments = run.lines();
  const std::vector<json> robot = CommandRun::json_lines(text_of(robot_log)),
                          dock = CommandRun::json_lines(text_of(dock_log));
  ASSERT_EQ(moments.size(), 8u);
  ASSERT_EQ(robot.size(), 8u);
  ASSERT_EQ(dock.size(), 8u);
  double squares = 0, fused_turn = 0, alone_turn = 0;
  for (std::size_t i = 0; i < moments.size(); ++i) {
    const json& moment = moments[i];
    EXPECT_EQ(moment.at("by"), "both");
    EXPECT_EQ(moment.at("robot").at("sequence"), moment.at("dock").at("sequence"));
    EXPECT_FALSE(moment.contains("disagree")) << moment;
    const Pose truth = robot_by(robot[i].at("truth").at(0));
    // The two scenarios are one flight: the dock's camera truly sees the robot's marker from there.
    const Pose seen = compose(inverse(cli::mounted_camera({0, 0.12, 0, 0, 0, 0})),
                              compose(truth, cli::mounted_marker({0, -0.12, 0, 0, 0, 0})));
    for (const double off : step_between(seen, pose_of(dock[i].at("truth").at(0).at("pose")))) {
      EXPECT_LT(std::fabs(off), 1e-9);
    }
    const auto error = step_between(pose_of(moment.at("pose")), truth);
    squares += mahalanobis(moment.at("pose").at("covariance"), error);
    fused_turn += dot({error[3], error[4], error[5]}, {error[3], error[4], error[5]});
    const auto alone = step_between(pose_of(robot[i].at("detections").at(0).at("pose")),
                                    pose_of(robot[i].at("truth").at(0).at("pose")));
    alone_turn += dot({alone[3], alone[4], alone[5]}, {alone[3], alone[4], alone[5]});
  }
  // Chi-square of 48 degrees of freedom, within four deviations.
  EXPECT_NEAR(squares, 48, 4 * 9.8);
  EXPECT_LT(fused_turn, alone_turn);
}

TEST(StationRun, GivesTheSameWhateverTheThreadsDo) {
  const ScratchFolder folder;
  const CommandRun one = run_stations(folder, {"json = \"-\"\n", "", "", 4, 4});
  const CommandRun again = run_stations(folder, {"json = \"-\"\n", "threads = 2\nbackend = \"cpu\"\n", "", 4, 4});
  ASSERT_EQ(one.exit_code, 0) << one.err;
  EXPECT_EQ(one.lines().size(), 4u);
  EXPECT_EQ(again.out, one.out);
}

TEST(StationRun, GoesOnWithTheStationThatIsLeft) {
  const ScratchFolder folder;
  const CommandRun run = run_stations(folder, {"", "", "", 2, 4}, {"--json", "-"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  const std::vector<json> moments = run.lines();
  ASSERT_EQ(moments.size(), 4u);
  EXPECT_EQ(moments[1].at("by"), "both");
  EXPECT_EQ(moments[2].at("by"), "dock");
  EXPECT_TRUE(moments[3].contains("pose"));
  EXPECT_FALSE(moments[3].contains("disagreement"));
  EXPECT_THAT(run.err, HasSubstr("2 by the dock's alone"));
}

TEST(StationRun, SaysThatAMountIsBent) {
  const ScratchFolder folder;
  std::string dock = kDockPart;
  dock.replace(dock.find("0,0.12,0,0,0,0"), 14, "0,0.12,0,5,0,0");
  const std::string path =
      folder.write("stations.toml", "[robot]\n" + kRobotPart + "max-frames = 1\n[dock]\n" + dock + "max-frames = 1\n");
  const CommandRun run = run_berth({"stations", path});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("THEY DISAGREE"));
  EXPECT_THAT(run.out, HasSubstr("the stations disagreed in 1"));
}

TEST(StationRun, TakesEachStationAtItsOwnPace) {
  const ScratchFolder folder;
  const std::string robot_log = folder / "robot.jsonl", dock_log = folder / "dock.jsonl";
  // Half a period of the slower one, so that most find a partner; the robot's ends first.
  const CommandRun run =
      run_stations(folder,
                   {"largest-difference-ms = 8\nwait-ms = 40\n", "fps = 60\njson = \"" + robot_log + "\"\n",
                    "fps = 100\njson = \"" + dock_log + "\"\n", 4, 12},
                   {"--json", "-"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  std::ptrdiff_t robot = 0, dock = 0;
  for (const json& moment : run.lines()) {
    robot += moment.contains("robot") ? 1 : 0;
    dock += moment.contains("dock") ? 1 : 0;
    if (moment.contains("difference_ns")) {
      EXPECT_LE(std::abs(moment["difference_ns"].get<std::int64_t>()), 8'000'000);
    }
  }
  const auto frames_in = [](const std::string& log) {
    const std::vector<json> lines = CommandRun::json_lines(text_of(log));
    return std::count_if(lines.begin(), lines.end(), [](const json& line) { return line.contains("detections"); });
  };
  EXPECT_GT(dock, 0);
  EXPECT_EQ(robot, frames_in(robot_log)) << "every frame is in a moment";
  EXPECT_EQ(dock, frames_in(dock_log));
}

struct Refused {
  File file;
  std::string says;
};

TEST(StationRun, RefusesWhatMakesNoPair) {
  const ScratchFolder folder;
  const std::vector<Refused> all = {
      {{"wait = 3\n", "", ""}, "field 'wait' is unknown; did you mean 'wait-ms'? docs/stations.md lists all keys"},
      {{"", "markr = \"x\"\n", ""}, "field 'markr' is unknown; did you mean 'marker'?"},
      {{"wait-ms = -1\n", "", ""}, "--wait-ms"},
      {{"", "pose = \"paper\"\n", ""}, "[robot] key 'pose' is 'paper'"},
      {{"", "", "family = \"tag25h9\"\n"}, "[dock] key 'marker' is 'tag36h11:9'; key 'family' leaves its family out"},
      {{"", "", "json = \"-\"\n"}, "[dock] key 'json' is '-'"},
  };
  for (const Refused& one : all) {
    const CommandRun run = run_stations(folder, one.file);
    EXPECT_EQ(run.exit_code, 2) << one.says;
    EXPECT_THAT(run.err, HasSubstr(one.says));
  }
  const CommandRun half = run_berth({"stations", folder.write("half.toml", "[robot]\n" + kRobotPart)});
  EXPECT_EQ(half.exit_code, 2);
  EXPECT_THAT(half.err, HasSubstr("the section [dock] is missing"));
}

TEST(StationRun, EndsWhereOneStationDoesNotBegin) {
  const ScratchFolder folder;
  const std::string path = folder.write(
      "stations.toml", "[robot]\n" + kRobotPart +
                           "[dock]\nsource = \"file:" BERTH_TEST_DATA
                           "/tag36h11_7.png\"\nmarker = \"tag36h11:7\"\nsize = 0.08\ncamera-at = \"0,0,0,0,0,0\"\n"
                           "marker-at = \"0,0,0,0,0,0\"\n");
  const CommandRun run = run_berth({"stations", path});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("[dock] station dock: key 'camera' is missing"));
  EXPECT_THAT(run.err, HasSubstr("[robot] station robot: ended, as the other station did not begin"));
}

}  // namespace
}  // namespace berth
