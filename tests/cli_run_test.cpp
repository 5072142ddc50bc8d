// `berth run` as a user meets it: its log, windows and filters, a camera's pace, its complaints.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>
#include <vector>

#include "berth/camera.hpp"
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

const std::string kTrack = "sim:" BERTH_SOURCE_DIR "/scenarios/track.toml";
const std::string kPort = BERTH_SOURCE_DIR "/targets/port.yaml";

TEST(Run, LogsEveryFrameOfAFolder) {
  const ScratchFolder folder;
  for (const char* name : {"1.png", "2.png", "3.png"}) std::filesystem::copy_file(kImage, folder / name);
  folder.write("2b.png", std::string());
  const CommandRun run = run_berth({"run", "--source", folder.path(), "--json", folder / "log", "--digests"});
  EXPECT_EQ(run.exit_code, 2) << "the empty file is bad input";
  EXPECT_THAT(run.err, HasSubstr("2b.png: the file is empty"));
  EXPECT_THAT(run.out, HasSubstr("3 frames, 3 with markers"));
  const std::vector<json> log = CommandRun::json_lines(text_of(folder / "log"));
  ASSERT_EQ(log.size(), 3u);
  EXPECT_EQ(log[2]["label"], folder / "3.png");
  EXPECT_EQ(log[2]["status"], "ok");
  EXPECT_EQ(log[2]["detections"][0]["id"], 7);
  EXPECT_FALSE(log[2]["digests"].empty());
  EXPECT_EQ(log[2]["digests"], log[0]["digests"]);
}

TEST(Run, FollowsMarkersInWindowsAndSaysWhere) {
  const ScratchFolder folder;
  const CommandRun run = run_berth(
      {"run", "--source", kTrack, "--max-frames", "4", "--json", folder / "log", "--track", "--full-every", "2"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  const std::vector<json> log = CommandRun::json_lines(text_of(folder / "log"));
  ASSERT_EQ(log.size(), 4u);
  const char* const why[] = {"none_held", "held", "regular", "held"};
  for (std::size_t i = 0; i < log.size(); ++i) {
    const json& search = log[i]["search"];
    EXPECT_EQ(search["why"], why[i]) << i;
    EXPECT_EQ(search["whole"], i % 2 == 0) << i;
    EXPECT_EQ(search["windows"].size(), i % 2) << i;
    EXPECT_EQ(search["held"], 1) << i;
    EXPECT_EQ(log[i]["detections"].size(), 1u) << i;
  }
  EXPECT_THAT(run.out, HasSubstr("whole: regular"));
}

// Frames of half the size are filtered, and their windows placed, by what --camera-fit makes of the file's camera.
TEST(Run, FiltersAndTracksByTheCameraThatFits) {
  const ScratchFolder folder;
  write_camera_info(folder / "twice.yaml", paper_camera(1280, 960));
  write_camera_info(folder / "fitting.yaml", resized_camera(paper_camera(1280, 960), 640, 480));
  const auto log_with = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {"run", "--source", kTrack, "--max-frames", "6", "--json", folder / "log",
                                     "--track", "--filter", "--camera"});
    const CommandRun run = run_berth(options);
    EXPECT_EQ(run.exit_code, 0) << run.err;
    return CommandRun::json_lines(text_of(folder / "log"));
  };
  const std::vector<json> expected = log_with({folder / "fitting.yaml"});
  const std::vector<json> log = log_with({folder / "twice.yaml", "--camera-fit", "resize"});
  ASSERT_EQ(log.size(), 6u);
  for (std::size_t i = 0; i < log.size(); ++i) {
    EXPECT_EQ(log[i]["search"], expected[i]["search"]) << i;
    ASSERT_EQ(log[i]["filtered"].size(), expected[i]["filtered"].size()) << i;
    if (expected[i]["filtered"].empty()) continue;
    const double expected_z = expected[i]["filtered"][0]["t"][2].get<double>();
    EXPECT_NEAR(log[i]["filtered"][0]["t"][2].get<double>(), expected_z, 1e-6) << i;
  }
  EXPECT_FALSE(log.back()["filtered"].empty());
}

TEST(Run, RefusesToTrackWhatWindowsDoNotShow) {
  const CommandRun run = run_berth({"run", "--source", "sim:not_there.toml", "--track", "--target", kPort});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, AllOf(HasSubstr("--track"), HasSubstr("--target"), HasSubstr("leave one of the two out")));
  const CommandRun alone = run_berth({"run", "--source", "sim:not_there.toml", "--full-every", "3"});
  EXPECT_EQ(alone.exit_code, 2);
  EXPECT_THAT(alone.err, AllOf(HasSubstr("--full-every"), HasSubstr("--track")));
}

TEST(Run, LogOnStandardOutputIsAllThatIsThere) {
  const CommandRun run = run_berth({"run", "--source", "file:" + kImage, "--json", "-"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  ASSERT_EQ(run.lines().size(), 1u);
  EXPECT_EQ(run.lines()[0]["detections"].size(), 1u);
  EXPECT_THAT(run.err, HasSubstr("1 frame, 1 with markers"));
}

TEST(Run, EndsAtMaxFrames) {
  const ScratchFolder folder;
  for (const char* name : {"1.png", "2.png", "3.png"}) std::filesystem::copy_file(kImage, folder / name);
  EXPECT_EQ(run_berth({"run", "--source", "dir:" + folder.path(), "--json", "-", "--max-frames", "2"}).lines().size(),
            2u);
}

TEST(Run, PlaysAFolderAtACamerasPace) {
  const ScratchFolder folder;
  for (const char* name : {"1.png", "2.png", "3.png"}) std::filesystem::copy_file(kImage, folder / name);
  cv::imwrite(folder / "4.png", cv::Mat(64, 64, CV_8U, cv::Scalar(90)));
  const CommandRun run = run_berth({"run", "--source", "dir:" + folder.path(), "--fps", "20", "--minutes", "0.01",
                                    "--slots", "3", "--deadline", "1000", "--json", folder / "log"});
  EXPECT_EQ(run.exit_code, 2) << "the fourth is of another size";
  EXPECT_THAT(run.err, HasSubstr("4.png: 64x64, but a camera's frames have one size"));
  EXPECT_THAT(run.out, HasSubstr("3 slots: "));
  EXPECT_THAT(run.out, HasSubstr("12 frames offered, "));
  std::vector<json> log = CommandRun::json_lines(text_of(folder / "log"));
  ASSERT_FALSE(log.empty());
  const json summary = log.back()["summary"];
  log.pop_back();
  EXPECT_EQ(summary["offered"], 12);
  EXPECT_EQ(summary["delivered"], log.size());
  const json& dropped = summary["dropped"];
  EXPECT_EQ(dropped["device"].get<std::size_t>() + dropped["host"].get<std::size_t>() +
                dropped["reader"].get<std::size_t>() + log.size(),
            12u);
  EXPECT_EQ(summary["results"]["differing"], 0);
  EXPECT_GT(summary["times_ms"]["latency"]["p50"], 0);
  EXPECT_EQ(summary["late"].size(), 1u);
  for (const json& line : log) {
    EXPECT_EQ(line["clock"], "monotonic");
    EXPECT_EQ(line["detections"][0]["id"], 7);
    EXPECT_GT(line["latency_ms"], 0);
    EXPECT_FALSE(line.contains("ms"));
  }
}

TEST(Run, RefusesAPaceThatCannotBe) {
  const auto refused = [](std::vector<std::string> options) {
    options.insert(options.begin(), {"run", "--source", "file:" + kImage});
    const CommandRun run = run_berth(options);
    EXPECT_EQ(run.exit_code, 2);
    return run.err;
  };
  EXPECT_THAT(refused({"--fps", "-3"}), HasSubstr("field '--fps'"));
  EXPECT_THAT(refused({"--fps", "3", "--deadline", "0"}), HasSubstr("field '--deadline'"));
  EXPECT_THAT(refused({"--fps", "3", "--slots", "1"}), HasSubstr("1 slots"));
  EXPECT_THAT(refused({"--fps", "3", "--cores", "70000"}), HasSubstr("core 70000 does not exist"));
  EXPECT_THAT(refused({"--fps", "3", "--lockstep", "simd,cpu"}), HasSubstr("leave --fps out"));
  EXPECT_THAT(refused({"--slots", "4"}), HasSubstr("--fps"));
  EXPECT_THAT(run_berth({"run", "--source", "v4l2:/dev/video0", "--fps", "30"}).err, HasSubstr("a pace of its own"));
}

}  // namespace
}  // namespace berth
