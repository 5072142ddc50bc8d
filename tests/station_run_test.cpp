// berth stations: two simulated cameras that see one flight from both its ends, whose truth is known.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/resource.h>

#include <algorithm>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include "moment_health.hpp"
#include "mount.hpp"
#include "pose_algebra.hpp"
#include "recording/cdr_reader.hpp"
#include "recording/mcap_reader.hpp"
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

/// What `record` at the top wrote down of its moments.
std::vector<json> moments_of(const std::string& path) {
  std::vector<json> moments;
  mcap::Reader reader(path);
  while (const mcap::Message* message = reader.next()) {
    if (reader.channels().at(message->channel).topic != "/berth/moment") continue;
    CdrReader fields(message->data, message->size);
    moments.push_back(json::parse(fields.string()));
  }
  return moments;
}

/// Records both stations and what they come to.
File recorded_in(const ScratchFolder& folder) {
  const auto record = [&](const char* name) { return "record = \"" + (folder / name) + "\"\n"; };
  return {record("both.mcap"), record("robot.mcap"), record("dock.mcap"), 5, 5};
}

TEST(StationRun, ReplaysToTheSameBits) {
  const ScratchFolder folder;
  const File file = recorded_in(folder);
  const CommandRun run = run_stations(folder, file, {"--json", "-"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("both.mcap: 5 moments"));
  ASSERT_EQ(run.lines().size(), 5u);
  EXPECT_EQ(moments_of(folder / "both.mcap"), run.lines());
  EXPECT_EQ(run.lines()[4].at("by"), "both");
  // On another backend and in other threads, from the recordings alone.
  File again = file;
  again.robot += "backend = \"cpu\"\nthreads = 2\n";
  const CommandRun replay = run_stations(folder, again, {"--json", "-", "--replay"});
  EXPECT_EQ(replay.exit_code, 0) << replay.err;
  EXPECT_EQ(replay.out, run.out);
  EXPECT_THAT(replay.err, HasSubstr("both   replay      5 moments, each equal to the recording bit for bit"));
  EXPECT_THAT(replay.err, HasSubstr("robot  replay      5 frames, each equal to the recording bit for bit"));
  EXPECT_THAT(run_berth({"replay", folder / "both.mcap"}).err, HasSubstr("berth stations FILE --replay"));
}

TEST(StationRun, AReplayNamesTheFirstMomentThatDiffers) {
  const ScratchFolder folder;
  ASSERT_EQ(run_stations(folder, recorded_in(folder)).exit_code, 0);
  // A mount in another place, by a bit.
  const std::string text = text_of(folder / "stations.toml");
  std::string moved = text;
  moved.replace(moved.find("0,0.12,0,0,0,0"), 14, "0,0.12000000000000001,0,0,0,0");
  const CommandRun replay = run_berth({"stations", folder.write("moved.toml", moved), "--replay"});
  EXPECT_EQ(replay.exit_code, 1) << replay.err;
  EXPECT_THAT(replay.out, HasSubstr("5 of 5 moments differ; the first: robot 0, dock 0 at "));
  EXPECT_THAT(replay.out, HasSubstr(" ns: pose."));
  // One station's recording is of fewer frames.
  ASSERT_EQ(run_berth({"run", "--source", "mcap:" + (folder / "dock.mcap"), "--max-frames", "3", "--size", "0.08",
                       "--corners", "photometric", "--record", folder / "short.mcap"})
                .exit_code,
            0);
  std::string lacking = text;
  lacking.replace(lacking.find("dock.mcap"), 9, "short.mcap");
  const CommandRun less = run_berth({"stations", folder.write("lacking.toml", lacking), "--replay"});
  EXPECT_EQ(less.exit_code, 1) << less.err;
  EXPECT_THAT(less.out, HasSubstr("replay      3 moments, each equal"));
  EXPECT_THAT(less.out, HasSubstr("4 are of other frames than any there"));
}

// RLIMIT_FSIZE fails as a full disk does.
TEST(StationRun, AFullDiskEndsTheRecordingAndNotTheRun) {
  const ScratchFolder folder;
  rlimit usual = {};
  ASSERT_EQ(getrlimit(RLIMIT_FSIZE, &usual), 0);
  rlimit small = usual;
  small.rlim_cur = 10'000;  // in the moments, wherever chunks end
  const auto before = std::signal(SIGXFSZ, SIG_IGN);
  const File file = {"record = \"" + (folder / "both.mcap") + "\"\n", "", "", 12, 12};
  ASSERT_EQ(setrlimit(RLIMIT_FSIZE, &small), 0);
  const CommandRun run = run_stations(folder, file, {"--json", "-"});
  setrlimit(RLIMIT_FSIZE, &usual);
  std::signal(SIGXFSZ, before);
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_EQ(run.lines().size(), 12u);
  EXPECT_THAT(run.err, HasSubstr("both.mcap: writing the recording failed (File too large)"));
  // What is whole stays, as much as it is; with what is said to be lost it is every moment.
  const std::size_t kept = moments_of(folder / "both.mcap").size();
  ASSERT_LT(kept, 12u);
  EXPECT_THAT(run.err, HasSubstr("both.mcap: " + std::to_string(kept) + " moment"));
  EXPECT_THAT(run.err, HasSubstr("; dropped " + std::to_string(12 - kept)));
}

TEST(MomentHealth, SaysWhetherTheStationsAgree) {
  cli::MomentHealth health(28);
  EXPECT_EQ(health.report().level, ros2::Level::stale);
  StationMoment moment;
  moment.came = {true, true};
  moment.difference_ns = -2'000'000;
  FusedPose fused;
  fused.used = {true, true};
  fused.has_pose = true;
  fused.robot.views = 2;
  fused.robot.disagreement = 7;
  health.add(moment, fused, {StationCounts{3, 1, 0, 2, 0}, StationCounts{3, 0, 0, 0, 0}});
  EXPECT_EQ(health.report().level, ros2::Level::ok);
  fused.robot.disagreement = 30;
  fused.disagree = true;
  health.add(moment, fused, {});
  fused.robot.disagreement = 8;
  fused.disagree = false;
  health.add(moment, fused, {});
  health.add(moment, fused, {});
  const ros2::DiagnosticStatus& some = health.report();
  EXPECT_EQ(some.level, ros2::Level::warn);
  EXPECT_EQ(some.message, "the stations disagree in 1 of 3 moments");
  std::string values;
  for (std::size_t i = 0; i < 10; ++i) values.append(some.values[i].key).append("=" + some.values[i].value + " ");
  EXPECT_EQ(values,
            "moments=4 by_both=4 by_robot=0 by_dock=0 without_pose=0 disagreed=1 disagreement=8.000 "
            "largest_disagreement=30.000 gate=28 largest_difference_ms=2.000 ");
  fused.robot.views = 1;
  fused.used = {false, true};
  health.add(moment, fused, {});
  EXPECT_EQ(health.report().message,
            "0 of 1 moments by both, 0 by the robot's camera alone, 1 by the dock's, 0 without "
            "a pose");
  fused.disagree = true;
  health.add(moment, fused, {});
  EXPECT_EQ(health.report().level, ros2::Level::error);
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
      {{"replay = true\n", "", ""}, "key 'record' at the top is missing"},
      {{"record = \"" + (folder / "a.mcap") + "\"\n", "record = \"" + (folder / "a.mcap") + "\"\n", ""},
       "[robot] key 'record' is '" + (folder / "a.mcap") + "'; the moments of both are recorded there"},
      {{"dock-frame = \"the dock\"\n", "", ""}, "--dock-frame \"the dock\": no name of a frame"},
      {{"ros = true\nros-topic = \"image=x\"\n", "", ""}, "give NAME=… with one of pose, detected_dock_pose, tf"},
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
