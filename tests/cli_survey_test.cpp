// `berth survey` as a user meets it: what it writes, and why it refuses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "berth/bundle.hpp"
#include "berth/camera.hpp"
#include "support/command_run.hpp"
#include "support/scratch_folder.hpp"
#include "support/surveyed_box.hpp"

namespace berth {
namespace {

using test::box;
using testing::HasSubstr;

TEST(CliSurvey, WritesTheBundle) {
  const test::ScratchFolder folder;
  const std::string scenario = BERTH_SOURCE_DIR "/scenarios/survey.toml";
  const auto run = test::run_berth({"survey", scenario, "--marker-size", "0.05", "--size", "4=0.04", "--size", "5=0.04",
                                    "--origin", "1", "-o", folder / "box.yaml", "--plot", folder / "box.svg", "--json",
                                    folder / "box.json", "--name", "box"});
  EXPECT_EQ(run.exit_code, 0) << run.err;
  EXPECT_THAT(run.out, HasSubstr("frame   60 of 60 (100%)"));
  EXPECT_THAT(run.out, HasSubstr("60 frames: 60 taken"));
  EXPECT_THAT(run.out, HasSubstr("tag36h11 5"));
  EXPECT_THAT(run.out, HasSubstr("box.yaml: 6 markers"));
  const std::vector<Bundle> bundles = read_bundles(folder / "box.yaml");
  ASSERT_EQ(bundles.size(), 1u);
  EXPECT_EQ(bundles[0].name, "box");
  EXPECT_GT(bundles[0].deviation_m, 0);
  EXPECT_LT(bundles[0].deviation_m, 0.00005);
  const auto json = nlohmann::json::parse(test::text_of(folder / "box.json"));
  ASSERT_EQ(json["markers"].size(), 6u);
  const std::vector<BundleMarker> truth = box();
  for (std::size_t m = 0; m < truth.size(); ++m) {
    const BundleMarker* found = bundles[0].find(*truth[m].family, truth[m].id);
    ASSERT_NE(found, nullptr);
    EXPECT_EQ(found->size_m, truth[m].size_m);
    const Pose place = compose(inverse(truth[1].pose), truth[m].pose);
    const std::array<double, 6> off = step_between(place, found->pose);
    for (std::size_t i = 0; i < 6; ++i) EXPECT_LT(std::fabs(off[i]), i < 3 ? 0.00003 : 0.0004) << m << " axis " << i;
    EXPECT_EQ(json["markers"][m]["id"], truth[m].id);
    EXPECT_EQ(json["markers"][m]["pose"]["t"][0], found->pose.t[0]);
  }
  EXPECT_THAT(test::text_of(folder / "box.svg"), HasSubstr("box: 6 markers, in the frame of tag36h11 1"));
}

TEST(CliSurvey, RefusesWithTheReasonAndWritesNothing) {
  const test::ScratchFolder folder;
  std::string scenario = test::text_of(BERTH_SOURCE_DIR "/scenarios/survey.toml");
  scenario.replace(scenario.find("frames = 60"), 11, "frames = 3");
  const std::string few = folder.write("few.toml", scenario);
  const auto run = test::run_berth({"survey", few, "--marker-size", "0.05", "--out", folder / "box.yaml"});
  EXPECT_EQ(run.exit_code, 1);
  EXPECT_THAT(run.err, HasSubstr("refused: too few frames: 3 of the 5"));
  EXPECT_EQ(test::text_of(folder / "box.yaml"), "");
  const auto refused = [&](std::vector<std::string> arguments, const char* words) {
    arguments.insert(arguments.begin(), "survey");
    const auto bad = test::run_berth(arguments);
    EXPECT_EQ(bad.exit_code, 2);
    EXPECT_THAT(bad.err, HasSubstr(words));
  };
  const std::string image = BERTH_TEST_DATA "/tag36h11_7.png";
  refused({few}, "--marker-size is required");
  refused({few, "--marker-size", "50mm"}, "field '--marker-size' is '50mm'; give metres");
  refused({few, "--marker-size", "0.05", "--size", "4:0.04"}, "give a marker's id and its side, e.g. 4=0.04");
  refused({few, "--marker-size", "0.05", "--size", "4=four"}, "field '--size' is 'four'");
  refused({image, "--marker-size", "0.05"}, "field '--camera' is missing");
  write_camera_info(folder / "large.yaml", paper_camera(640, 480));
  refused({image, "--marker-size", "0.05", "--camera", folder / "large.yaml"}, "but the camera's image is 640x480");
  refused({"--marker-size", "0.05"}, "give images, or a --source");
}

}  // namespace
}  // namespace berth
