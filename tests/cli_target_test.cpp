// Targets of discs on the command line: found, logged, drawn, scored against the truth, printed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <string>

#include "as_mat.hpp"
#include "berth/camera.hpp"
#include "sim/render.hpp"
#include "support/command_run.hpp"
#include "support/disc_scene.hpp"
#include "target_sheet.hpp"

namespace berth {
namespace {

using test::CommandRun;
using test::run_berth;
using test::ScratchFolder;
using testing::HasSubstr;

const std::string kRoot = BERTH_SOURCE_DIR;
const std::string kPort = kRoot + "/targets/port.yaml";

TEST(CliTarget, DetectGivesItsPose) {
  const ScratchFolder folder;
  const CameraModel camera = paper_camera(320, 240);
  const DiscTarget target = read_disc_target(kPort);
  sim::Random random(2);
  const Pose truth = test::random_target_pose(camera, target, 20, 20, random);
  const GrayImage image = sim::render(test::target_scene(camera, target, truth, 0.6, 2, 3));
  const View2D<const u8> view = image.view();
  const std::string file = folder / "port.png";
  ASSERT_TRUE(cv::imwrite(file, as_mat(view)));
  write_camera_info(folder / "cam.yaml", camera);

  const CommandRun run = run_berth(
      {"detect", "--json", "--target", kPort, "--camera", folder / "cam.yaml", "--draw", folder / "seen.png", file});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_EQ(run.err, "");
  const nlohmann::json line = run.lines().at(0);
  ASSERT_EQ(line["targets"].size(), 1u);
  const nlohmann::json& found = line["targets"][0];
  EXPECT_EQ(found["name"], "port");
  EXPECT_EQ(found["used"], 5);
  EXPECT_EQ(found["discs"].size(), 5u);
  EXPECT_EQ(found["pose"]["covariance"].size(), 36u);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(found["pose"]["t"][k], truth.t[k], 0.002 * truth.t[2]);
  const cv::Mat drawn = cv::imread(folder / "seen.png");
  ASSERT_FALSE(drawn.empty());
  int coloured = 0;
  for (int i = 0; i < drawn.rows * drawn.cols; ++i) {
    const cv::Vec3b& pixel = drawn.at<cv::Vec3b>(i / drawn.cols, i % drawn.cols);
    coloured += pixel[1] > pixel[0] + 80 ? 1 : 0;
  }
  EXPECT_GT(coloured, 500);

  const CommandRun table = run_berth({"detect", "--target", kPort, "--camera", folder / "cam.yaml", file});
  EXPECT_THAT(table.out, HasSubstr("target port: xyz "));
  EXPECT_THAT(table.out, HasSubstr("from 5 of 5 discs\n"));
  const CommandRun blind = run_berth({"detect", "--json", "--target", kPort, file});
  EXPECT_EQ(blind.exit_code, 0);
  EXPECT_THAT(blind.err, HasSubstr("no poses: --camera is missing"));
  EXPECT_FALSE(blind.lines().at(0).contains("targets"));
  const CommandRun bad = run_berth({"detect", "--target", folder / "none.yaml", file});
  EXPECT_EQ(bad.exit_code, 2);
  EXPECT_THAT(bad.err, HasSubstr("none.yaml: cannot read the target file; check the path"));
}

TEST(CliTarget, RunScoresItAgainstTheTruth) {
  const CommandRun run = run_berth({"run", "--source", "sim:" + kRoot + "/scenarios/port.toml", "--target", kPort,
                                    "--max-frames", "3", "--json", "-"});
  ASSERT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.err, HasSubstr("target port"));
  EXPECT_THAT(run.err, HasSubstr("3/3"));
  EXPECT_THAT(run.err, HasSubstr("3 with markers"));
  ASSERT_EQ(run.lines().size(), 3u);
  for (const nlohmann::json& line : run.lines()) {
    EXPECT_EQ(line["targets"][0]["used"], 5);
    EXPECT_EQ(line["status"], "ok");
    EXPECT_NEAR(line["targets"][0]["pose"]["t"][2], line["truth_targets"][0]["pose"]["t"][2].get<double>(), 0.01);
  }
}

TEST(CliTarget, ScenariosSayWhichFileIsMissing) {
  const ScratchFolder folder;
  const std::string scenario = folder.write("s.toml", std::string("[[disc_target]]\nfile = \"none.yaml\"\n"));
  const CommandRun run = run_berth({"run", "--source", "sim:" + scenario});
  EXPECT_EQ(run.exit_code, 2);
  EXPECT_THAT(run.err, HasSubstr((folder / "none.yaml") + ": cannot read the target file"));
}

TEST(CliTarget, PrintTagPrintsItAtTrueSize) {
  const ScratchFolder folder;
  const CommandRun svg = run_berth({"print-tag", "--target", kPort, "--out", folder / "port.svg"});
  ASSERT_EQ(svg.exit_code, 0) << svg.err;
  EXPECT_THAT(svg.out, HasSubstr("target port, 5 discs; print at 100 %"));
  const std::string text = test::text_of(folder / "port.svg");
  EXPECT_THAT(text, HasSubstr("100 mm from middle to middle"));
  std::size_t dark = 0, light = 0;
  for (std::size_t at = text.find("<circle"); at != std::string::npos; at = text.find("<circle", at + 1)) {
    const std::string circle = text.substr(at, text.find("/>", at) - at);
    const bool is_light = circle.find("fill=\"#fff\"") != std::string::npos;
    EXPECT_THAT(circle, HasSubstr(is_light ? "r=\"7.5000\"" : "r=\"15.0000\""));
    ++(is_light ? light : dark);
  }
  EXPECT_EQ(dark, 5u);
  EXPECT_EQ(light, 1u);
  const CommandRun pdf = run_berth({"print-tag", "--target", kRoot + "/targets/cross.yaml", "--out", folder / "c.pdf"});
  ASSERT_EQ(pdf.exit_code, 0) << pdf.err;
  EXPECT_THAT(test::text_of(folder / "c.pdf"), HasSubstr(" c f 0 g\n"));
  const CommandRun small =
      run_berth({"print-tag", "--target", kPort, "--paper", "140x120", "--out", folder / "small.pdf"});
  EXPECT_EQ(small.exit_code, 2);
  EXPECT_THAT(small.err, HasSubstr("choose larger --paper"));
  const CommandRun both = run_berth({"print-tag", "--target", kPort, "--bundle", kPort, "--out", folder / "both.pdf"});
  EXPECT_EQ(both.exit_code, 2);
  EXPECT_THAT(both.err, HasSubstr("give one of them"));
}

}  // namespace
}  // namespace berth
