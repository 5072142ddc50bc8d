// The command as a user meets it: what goes to standard output, which files appear, which code it ends with.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "support/command_run.hpp"
#include "support/marker_image.hpp"

namespace berth {
namespace {

using nlohmann::json;
using test::CommandRun;
using test::kImage;
using test::run_berth;
using test::ScratchFolder;
using test::text_of;
using testing::HasSubstr;
using testing::StartsWith;

TEST(Command, ExplainsItselfWithExamples) {
  const CommandRun help = run_berth({"--help"});
  EXPECT_EQ(help.exit_code, 0);
  EXPECT_EQ(help.err, "");
  for (const char* name : {"demo", "detect", "run", "verify", "doctor"}) {
    EXPECT_THAT(help.out, HasSubstr(name));
    const CommandRun command_help = run_berth({name, "--help"});
    EXPECT_EQ(command_help.exit_code, 0);
    EXPECT_THAT(command_help.out, HasSubstr("Examples:\n  berth " + std::string(name)));
  }
  EXPECT_THAT(run_berth({"--version"}).out, StartsWith("berth "));
  EXPECT_EQ(run_berth({"--version"}).exit_code, 0);
}

TEST(Demo, FliesFromFirstSightToTheMarker) {
  const ScratchFolder folder;
  const CommandRun run = run_berth({"demo", "--frames", "24", "--seed", "3", "--out", folder / "new/demo"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("-> docking: the marker is read and near"));
  EXPECT_THAT(run.out, HasSubstr("\ndocked; longest gap"));
  EXPECT_THAT(text_of(folder / "new/demo/flight.svg"), StartsWith("<svg "));
  EXPECT_FALSE(cv::imread(folder / "new/demo/flight.png").empty());
}

TEST(Demo, LeavesLogDrawingAndPictureOfAScenario) {
  const ScratchFolder folder;
  const std::string scenario = std::string(BERTH_SOURCE_DIR) + "/scenarios/approach.toml";
  const CommandRun run = run_berth({"demo", "--scenario", scenario, "--out", folder / "new/demo", "--max-frames", "3"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("errors against the simulator's truth"));
  const std::vector<json> log = CommandRun::json_lines(text_of(folder / "new/demo/log.jsonl"));
  ASSERT_EQ(log.size(), 3u);
  for (const json& frame : log) {
    ASSERT_FALSE(frame["truth"].empty());
    ASSERT_FALSE(frame["detections"].empty());
    // The estimate of the largest marker is near its truth: 2 % of the range.
    const json& truth = frame["truth"][0]["pose"]["t"];
    const json& found = frame["detections"][0]["pose"]["t"];
    for (int i = 0; i < 3; ++i) {
      EXPECT_NEAR(found[i].get<double>(), truth[i].get<double>(), 0.02 * truth[2].get<double>());
    }
  }
  EXPECT_THAT(text_of(folder / "new/demo/trajectory.svg"), StartsWith("<svg "));
  EXPECT_THAT(text_of(folder / "new/demo/trajectory.svg"), HasSubstr("</svg>"));
  EXPECT_FALSE(cv::imread(folder / "new/demo/markers.png").empty());
}

/// Sets an environment variable for one test.
class Environment {
 public:
  Environment(const char* name, const char* value) : name_(name) { setenv(name, value, 1); }
  ~Environment() { unsetenv(name_); }
  Environment(const Environment&) = delete;
  Environment& operator=(const Environment&) = delete;

 private:
  const char* name_;
};

TEST(Verify, OneLineForTheBackendAskedFor) {
  const CommandRun run = run_berth({"verify", "--backend", "simd", "--image", kImage});
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(run.out, StartsWith("simd       ok "));
  EXPECT_EQ(std::count(run.out.begin(), run.out.end(), '\n'), 1);
}

TEST(Verify, FailsWhenAnExpectedBackendIsMissing) {
  const Environment expect("BERTH_EXPECT", "simd,hovercraft");
  const CommandRun run = run_berth({"verify", "--backend", "simd"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.out, HasSubstr("hovercraft MISSING"));
}

TEST(Doctor, DescribesTheMachine) {
  const CommandRun text = run_berth({"doctor"});
  EXPECT_EQ(text.exit_code, 0);
  EXPECT_THAT(text.out, HasSubstr("kernel cache"));
  const CommandRun run = run_berth({"doctor", "--json"});
  ASSERT_EQ(run.exit_code, 0);
  const json description = json::parse(run.out);
  ASSERT_FALSE(description["backends"].empty());
  for (const json& backend : description["backends"]) {
    // Each backend has a device or a reason, and what is absent is among what is missing.
    EXPECT_EQ(backend["available"].get<bool>(), !backend["devices"].empty()) << backend;
    EXPECT_EQ(backend["available"].get<bool>(), !backend.contains("absent")) << backend;
  }
  EXPECT_TRUE(description["kernel_cache"]["path"].is_string());
}

TEST(Doctor, FollowsTheCacheFolder) {
  const ScratchFolder folder;
  const Environment cache("XDG_CACHE_HOME", folder.path().c_str());
  std::filesystem::create_directories(folder / "berth");
  folder.write("berth/kernel.bin", std::string("12345"));
  const json description = json::parse(run_berth({"doctor", "--json"}).out);
  EXPECT_EQ(description["kernel_cache"]["path"], folder / "berth");
  EXPECT_EQ(description["kernel_cache"]["entries"], 1);
  EXPECT_EQ(description["kernel_cache"]["bytes"], 5);
}

}  // namespace
}  // namespace berth
