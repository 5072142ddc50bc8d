// What the command does with several backends: verify's long runs and report, lockstep, fall-back.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "support/command_run.hpp"
#include "work/machine.hpp"

namespace berth {
namespace {

using test::run_berth;
using test::ScratchFolder;
using testing::HasSubstr;

std::string scenario() { return std::string("sim:") + BERTH_SOURCE_DIR + "/scenarios/approach.toml"; }

TEST(CliVerify, RunsMixedFramesAndWritesAReport) {
  const ScratchFolder folder;
  const std::string path = folder / "report.json";
  const test::CommandRun run = run_berth({"verify", "--backend", "cpu", "--frames", "9", "--json", path});
  EXPECT_EQ(run.exit_code, 0) << run.out << run.err;
  EXPECT_THAT(run.out, HasSubstr("9 mixed frames"));
  const nlohmann::json report = nlohmann::json::parse(test::text_of(path));
  ASSERT_EQ(report.size(), 1u);
  EXPECT_EQ(report[0].at("backend"), "cpu");
  EXPECT_EQ(report[0].at("ok"), true);
  EXPECT_EQ(report[0].at("mixed_frames"), 9);
  EXPECT_GT(report[0].at("cases").get<int>(), 500);
}

TEST(CliVerify, ReportThatCannotBeWrittenIsAnError) {
  const test::CommandRun run = run_berth({"verify", "--backend", "cpu", "--json", "/no/such/folder/report.json"});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr("/no/such/folder/report.json"));
}

TEST(CliBench, TimesBackendsAndExplainsAFrame) {
  const ScratchFolder folder;
  const std::string json = folder / "bench.json", tables = folder / "bench.md", drawing = folder / "bench.svg";
  const test::CommandRun run =
      run_berth({"bench",  "--backend", "simd,cpu",   "--frames",  "2",       "--width", "320",       "--height",
                 "240",    "--repeat",  "1",          "--explain", "--modes", "docking", "--machine", "tx1",
                 "--json", json,        "--markdown", tables,      "--svg",   drawing});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("2 frames of 320x240"));
  EXPECT_THAT(run.out, HasSubstr("NVIDIA Jetson TX1"));
  EXPECT_THAT(run.out, HasSubstr("The same calculation was off by a factor of"));
  EXPECT_THAT(test::text_of(tables), HasSubstr("| run_link |"));
  EXPECT_THAT(test::text_of(drawing), HasSubstr("</svg>"));
  const nlohmann::json report = nlohmann::json::parse(test::text_of(json));
  ASSERT_EQ(report.at("backends").size(), 2u);
  for (const nlohmann::json& one : report.at("backends")) EXPECT_GT(one.at("wall_ms").get<double>(), 0);
  const nlohmann::json& explained = report.at("explain");
  const nlohmann::json& counted = explained.at("counted").at(0);
  EXPECT_EQ(counted.at("steps").size(), counted.at("launches").get<std::size_t>());
  EXPECT_EQ(counted.at("uploaded"), 320 * 240);
  for (const nlohmann::json& step : counted.at("steps")) {  // every launch touches and does something
    EXPECT_GT(step.at("read").get<int>() + step.at("written").get<int>(), 0) << step;
    EXPECT_GT(step.at("span").get<int>(), 0) << step;
  }
  ASSERT_EQ(explained.at("measured").size(), 2u);
  for (const nlohmann::json& one : explained.at("measured")) {
    const nlohmann::json& mode = one.at("modes").at(0);
    EXPECT_EQ(mode.at("steps").size(), counted.at("steps").size());
    EXPECT_GT(mode.at("frame_us").get<double>(), 0);
    EXPECT_GT(mode.at("predicted_us").get<double>(), 0);
  }
  EXPECT_GT(explained.at("projected").at(0).at("modes").at(0).at("us").get<double>(), 0);
}

TEST(CliBench, DescribesThisMachine) {
  const ScratchFolder folder;
  const std::string path = folder / "here.toml";
  const test::CommandRun run =
      run_berth({"bench", "--describe-machine", path, "--backend", "cpu", "--width", "320", "--height", "240"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const work::Machine machine = work::read_machine(path);
  EXPECT_EQ(machine.backend, "cpu");
  EXPECT_FALSE(machine.items_in_parallel);
  EXPECT_EQ(run_berth({"bench", "--describe-machine", path, "--backend", "cpu,simd"}).exit_code, 2);
  EXPECT_THAT(run_berth({"bench", "--explain", "--machine", "abacus", "--frames", "1", "--repeat", "1"}).err,
              HasSubstr("tx1, jetson-nano"));
}

TEST(CliChaos, GoesOnWhereItsFileEnds) {
  const test::ScratchFolder folder;
  const std::string file = folder / "chaos.json";
  const test::CommandRun first = test::run_berth({"chaos", "--flips", "12", "--json", file});
  EXPECT_EQ(first.exit_code, 0) << first.err;
  EXPECT_THAT(first.out, HasSubstr("12 flips on simd, seed 1"));
  const test::CommandRun second = test::run_berth({"chaos", "--flips", "18", "--json", file});
  EXPECT_THAT(second.out, HasSubstr("18 flips on simd, seed 1"));
  const auto json = nlohmann::json::parse(test::text_of(file));
  EXPECT_EQ(json["flips"], 18);
  EXPECT_EQ(json["regions"]["image"]["flips"], 18);
  const test::CommandRun other = test::run_berth({"chaos", "--flips", "18", "--seed", "2", "--json", file});
  EXPECT_EQ(other.exit_code, 2);
  EXPECT_THAT(other.err, HasSubstr("another campaign"));
  folder.write("chaos.json", std::string("{}"));
  EXPECT_THAT(test::run_berth({"chaos", "--json", file}).err, HasSubstr("no report of berth chaos"));
}

TEST(CliRun, LockstepComparesEveryFrame) {
  const test::CommandRun run =
      run_berth({"run", "--source", scenario(), "--max-frames", "3", "--lockstep", "simd,cpu"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("in lockstep with cpu on"));
  EXPECT_THAT(run.out, HasSubstr("3 frames, 3 with markers, 0 differing"));
}

TEST(CliRun, SaysHowTheEngineIs) {
  const test::CommandRun run =
      run_berth({"run", "--source", scenario(), "--backend", "simd", "--max-frames", "3", "--known-answer", "60"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("health      nominal: 1 known answer, 0 wrong; "));
  const test::CommandRun both =
      run_berth({"run", "--source", scenario(), "--max-frames", "1", "--known-answer", "60", "--lockstep", "simd,cpu"});
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_THAT(both.err, HasSubstr("--known-answer"));
}

TEST(CliRun, LockstepAndFallbackNameWhatIsWrong) {
  const struct {
    std::vector<std::string> arguments;
    const char* message;
  } cases[] = {
      {{"--lockstep", "simd"}, "give two backends"},
      {{"--lockstep", "simd,abacus"}, "'abacus'; this build has no such backend"},
      {{"--lockstep", "simd,cpu", "--backend", "simd"}, "no --backend"},
      {{"--backend", "simd", "--fallback", "abacus"}, "--fallback"},
  };
  for (const auto& wrong : cases) {
    std::vector<std::string> arguments = {"run", "--source", scenario(), "--max-frames", "1"};
    arguments.insert(arguments.end(), wrong.arguments.begin(), wrong.arguments.end());
    const test::CommandRun run = run_berth(arguments);
    EXPECT_EQ(run.exit_code, 2) << wrong.message;
    EXPECT_THAT(run.err, HasSubstr(wrong.message));
  }
}

}  // namespace
}  // namespace berth
