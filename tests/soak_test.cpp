// The soak: scenarios that a seed repeats, a state that it goes on from, and violations that it must see.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <fstream>

#include "berth/error.hpp"
#include "soak_report.hpp"
#include "support/command_run.hpp"
#include "support/complaint.hpp"
#include "support/scratch_folder.hpp"

namespace berth::cli {
namespace {

using test::CommandRun;
using test::run_berth;
using test::ScratchFolder;
using testing::AllOf;
using testing::HasSubstr;

/// A short scenario of one marker, without what takes long.
SoakScenario short_scenario() {
  SoakScenario scenario;
  for (u64 number = 0;; ++number) {
    scenario = draw_scenario(1, number, {"simd", "cpu"});
    if (scenario.width == 320 && scenario.markers.size() == 1 && scenario.corners == "edges") break;
  }
  scenario.in_real_time = scenario.film.in_real_time = false;
  scenario.lockstep = scenario.track = scenario.record = scenario.known_answers = false;
  scenario.backend_fault = BackendFault::none;
  scenario.starved.clear();
  scenario.frames = scenario.film.frames = 30;
  scenario.pictures = 3;
  const std::size_t frames = scenario.toml.find("frames = ");
  scenario.toml.replace(frames, scenario.toml.find('\n', frames) - frames, "frames = 3");
  scenario.film.kinds = {CameraFault::dropped, CameraFault::doubled, CameraFault::torn, CameraFault::half,
                         CameraFault::frozen,  CameraFault::back,    CameraFault::ahead};
  scenario.film.share = 0.5;
  return scenario;
}

TEST(Soak, ASeedAndANumberAreAScenario) {
  const std::vector<std::string> backends = {"simd", "cpu", "reference"};
  std::size_t recorded = 0, in_real_time = 0;
  for (u64 number = 0; number < 40; ++number) {
    const SoakScenario a = draw_scenario(5, number, backends), b = draw_scenario(5, number, backends);
    EXPECT_EQ(a.toml, b.toml);
    EXPECT_EQ(a.describe(), b.describe());
    EXPECT_EQ(a.film.seed, b.film.seed);
    EXPECT_NE(a.toml, draw_scenario(6, number, backends).toml);
    recorded += a.record ? 1U : 0U;
    in_real_time += a.in_real_time ? 1U : 0U;
  }
  EXPECT_GT(recorded, 5U);
  EXPECT_GT(in_real_time, 5U);
}

TEST(Soak, AScenarioWithFaultsHoldsWhatMustHold) {
  const SoakBackends backends;
  const SoakOutcome outcome = run_scenario(short_scenario(), backends);
  for (const SoakViolation& violation : outcome.violations) ADD_FAILURE() << violation.what;
  EXPECT_EQ(outcome.tally.frames, 30U);
  EXPECT_EQ(outcome.tally.compared, 30U);
  EXPECT_GT(outcome.tally.poses, 20U);
  u64 faults = 0;
  for (std::size_t i = 1; i < kCameraFaults; ++i) faults += outcome.tally.camera_faults[i];
  EXPECT_GT(faults, 1U);
}

// A detector for images of a new size must not be made on a device that was lost before.
TEST(Soak, ALostDeviceIsNotAskedForFramesOfAnotherSize) {
  SoakScenario scenario = short_scenario();
  scenario.backend_fault = BackendFault::lost;
  scenario.backend_fault_frame = 1;
  scenario.film.kinds = {CameraFault::resized};
  scenario.film.share = 0.2;
  const SoakOutcome outcome = run_scenario(scenario, SoakBackends());
  for (const SoakViolation& violation : outcome.violations) ADD_FAILURE() << violation.what;
  EXPECT_EQ(outcome.tally.frames, 30U);
  EXPECT_EQ(outcome.tally.failed_over, 1U);
  EXPECT_GE(outcome.tally.camera.reopened, 2U);
}

// For five seconds, which leaves a busy machine the time to open it anew.
TEST(Soak, ADeviceThatHangsIsLeftAndGoneBackTo) {
  SoakScenario scenario = short_scenario();
  scenario.backend_fault = BackendFault::hung;
  scenario.backend_fault_frame = 3;
  scenario.fail_back = scenario.known_answers = true;
  scenario.in_real_time = scenario.film.in_real_time = true;
  scenario.frames = scenario.film.frames = 300;
  scenario.frames_per_second = scenario.film.frames_per_second = 60;
  scenario.film.share = 0;
  const SoakOutcome outcome = run_scenario(scenario, SoakBackends());
  for (const SoakViolation& violation : outcome.violations) ADD_FAILURE() << violation.what;
  EXPECT_EQ(outcome.tally.frames + outcome.tally.dropped, 300U);
  EXPECT_EQ(outcome.tally.devices_hung, 1U);
  EXPECT_EQ(outcome.tally.failed_over, 1U);
  EXPECT_EQ(outcome.tally.returned, 1U);
}

// By the disk's end, and by threads that stand still.
TEST(Soak, DiskAndThreadsMayFail) {
  SoakScenario scenario = short_scenario();
  scenario.record = true;
  scenario.recorded = RecordPictures::raw;
  scenario.disk_bytes = 1'500'000;
  scenario.in_real_time = scenario.film.in_real_time = true;
  scenario.starved = {3, 6, 9};
  scenario.frames = scenario.film.frames = 60;
  scenario.frames_per_second = scenario.film.frames_per_second = 120;
  const SoakOutcome outcome = run_scenario(scenario, SoakBackends());
  for (const SoakViolation& violation : outcome.violations) ADD_FAILURE() << violation.what;
  EXPECT_EQ(outcome.tally.frames + outcome.tally.dropped, 60U);
  EXPECT_GE(outcome.tally.threads_stopped, 1U);
  EXPECT_EQ(outcome.tally.replayed, 1U);
}

TEST(Soak, SeesASourceThatLiesAboutIds) {
  const SoakBackends backends;
  const SoakOutcome outcome = run_scenario(short_scenario(), backends, [](std::vector<TruthMarker>& truth) {
    for (TruthMarker& marker : truth) ++marker.id;
  });
  ASSERT_FALSE(outcome.violations.empty());
  EXPECT_THAT(outcome.violations[0].what, HasSubstr("is not in the frame"));
  SoakReport report;
  report.begin_run();
  report.add(outcome, 1, {});
  EXPECT_EQ(report.violation_count, outcome.violations.size());
  std::ostringstream text;
  print(text, report);
  EXPECT_THAT(text.str(), HasSubstr("is not in the frame; berth soak --seed 1 --scenario "));
  EXPECT_THAT(to_line(to_json(report)), HasSubstr("is not in the frame"));
}

TEST(Soak, SeesPosesThatAreWrong) {
  const SoakBackends backends;
  const SoakOutcome outcome = run_scenario(short_scenario(), backends, [](std::vector<TruthMarker>& truth) {
    for (TruthMarker& marker : truth) marker.pose.t[2] *= 1.05;
  });
  ASSERT_FALSE(outcome.violations.empty());
  EXPECT_THAT(outcome.violations[0].what, HasSubstr("has a wrong pose: "));
}

TEST(Soak, SeesMemoryThatGrows) {
  SoakReport report;
  report.begin_run();
  for (u64 i = 0; i < kSettled; ++i) report.add({}, 1, {100'000'000, 50'000'000});
  report.add({}, 1, {100'000'000 + kMostResidentGrowth, 50'000'000 + kMostAllocatedGrowth});
  EXPECT_EQ(report.violation_count, 0U);
  report.add({}, 1, {100'000'001 + kMostResidentGrowth, 50'000'000});
  report.add({}, 1, {100'000'000, 50'000'001 + kMostAllocatedGrowth});
  ASSERT_EQ(report.violation_count, 2U);
  EXPECT_THAT(report.violations[0].what, HasSubstr("resident memory is 164.0 MB"));
  EXPECT_THAT(report.violations[1].what, HasSubstr("allocated memory is 66.0 MB"));
}

TEST(Soak, GoesOnFromItsState) {
  const ScratchFolder folder;
  const std::string state = folder / "soak.json";
  CommandRun run = run_berth({"soak", "--seed", "3", "--scenarios", "1", "--state", state});
  EXPECT_EQ(run.exit_code, 0) << run.out;
  EXPECT_THAT(run.out, AllOf(HasSubstr("from scenario 0 of seed 3"), HasSubstr("1 scenarios of seed 3")));
  const SoakReport first = read_soak_report(state, 3);
  EXPECT_GT(first.tally.frames, 0U);
  // Done is done.
  run = run_berth({"soak", "--seed", "3", "--scenarios", "1", "--state", state, "--report", folder / "soak.md"});
  EXPECT_THAT(run.out, AllOf(HasSubstr("from scenario 1 of seed 3"), HasSubstr("2 runs")));
  EXPECT_EQ(read_soak_report(state, 3).tally.frames, first.tally.frames);
  std::ifstream report(folder / "soak.md");
  std::string line;
  std::getline(report, line);
  EXPECT_THAT(line, HasSubstr("0 violations"));
  EXPECT_THAT(test::complaint([&] { read_soak_report(state, 4); }), HasSubstr("of another soak"));
  std::ofstream(state) << "{}";
  EXPECT_THAT(test::complaint([&] { read_soak_report(state, 3); }), HasSubstr("no state of berth soak"));
}

}  // namespace
}  // namespace berth::cli
