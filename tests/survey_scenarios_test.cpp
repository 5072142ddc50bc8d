// Surveys of scenarios that the simulator renders, by both ways to find corners.
#include <gtest/gtest.h>

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "berth/detector.hpp"
#include "sim/scenario.hpp"
#include "support/command_run.hpp"
#include "support/scratch_folder.hpp"
#include "support/surveyed_box.hpp"

namespace berth {
namespace {

using test::box;
using test::box_options;
using test::expect_recovered;
using test::fisheye_camera;
using test::marker;

/// What Berth sees in a scenario.
SurveyFrames sightings(const std::string& scenario, CornerMethod corners, CameraModel& camera) {
  const std::unique_ptr<Source> source = open_scenario(scenario);
  camera = *source->camera();
  DetectorConfig config;
  config.camera = camera;
  config.marker_size_m = 0.05;
  config.corner_method = corners;
  const auto backend = open_backend("simd");
  Detector detector(*backend, camera.width, camera.height, config);
  SurveyFrames frames(camera.width, 300);
  while (const std::optional<SourceFrame> frame = source->next()) {
    frames.add({frame->label, detector.detect(frame->image.view()).detections});
  }
  return frames;
}

class EveryCorner : public testing::TestWithParam<CornerMethod> {};
INSTANTIATE_TEST_SUITE_P(Corners, EveryCorner, testing::Values(CornerMethod::edges, CornerMethod::photometric),
                         [](const auto& method) {
                           return method.param == CornerMethod::edges ? "edges" : "photometric";
                         });

// Corners by lines lean to one side where a marker is seen askance, which no residual tells: there the errors go up
// to 3.1 deviations.
TEST_P(EveryCorner, SurveysARenderedBox) {
  CameraModel camera;
  const SurveyFrames frames = sightings(BERTH_SOURCE_DIR "/scenarios/survey.toml", GetParam(), camera);
  const Survey found = survey(frames, camera, box_options());
  const bool by_lines = GetParam() == CornerMethod::edges;
  expect_recovered(box(), found, by_lines ? 0.0001 : 0.00002, by_lines ? 0.15 : 0.015, by_lines ? 4 : 3);
}

TEST_P(EveryCorner, SurveysTheDockOfTheApproach) {
  std::string approach = test::text_of(BERTH_SOURCE_DIR "/scenarios/approach.toml");
  const std::size_t count = approach.find("frames = 140");
  ASSERT_NE(count, std::string::npos);
  approach.replace(count, 12, "frames = 40");
  const test::ScratchFolder folder;
  CameraModel camera;
  const SurveyFrames frames = sightings(folder.write("approach.toml", approach), GetParam(), camera);
  SurveyOptions options;
  options.size_m = 0.03;
  options.sizes_m = {{0, 0.1}};
  const Survey found = survey(frames, camera, options);
  const std::vector<BundleMarker> dock = {marker(0, 0.1, {0, 0, 0}, {}), marker(1, 0.03, {-0.09, -0.055, 0}, {}),
                                          marker(2, 0.03, {-0.09, 0.055, 0}, {}), marker(3, 0.03, {0.09, 0.055, 0}, {}),
                                          marker(4, 0.03, {0.09, -0.055, 0}, {})};
  const bool by_lines = GetParam() == CornerMethod::edges;
  expect_recovered(dock, found, by_lines ? 0.0001 : 0.00003, by_lines ? 0.1 : 0.03);
}

// Far from straight sides.
TEST_P(EveryCorner, SurveysThroughAFisheye) {
  const test::ScratchFolder folder;
  write_camera_info(folder / "fisheye.yaml", fisheye_camera());
  std::string scenario = test::text_of(BERTH_SOURCE_DIR "/scenarios/survey.toml");
  scenario.replace(scenario.find("range_m = [0.4, 0.65]"), 21, "range_m = [0.25, 0.4]");
  scenario.replace(scenario.find("[trajectory]"), 12, "[camera]\nfile = \"fisheye.yaml\"\n\n[trajectory]");
  CameraModel camera;
  const SurveyFrames frames = sightings(folder.write("fisheye.toml", scenario), GetParam(), camera);
  ASSERT_EQ(camera.lens, LensModel::equidistant);
  const Survey found = survey(frames, camera, box_options());
  const bool by_lines = GetParam() == CornerMethod::edges;
  expect_recovered(box(), found, by_lines ? 0.0001 : 0.00003, by_lines ? 0.25 : 0.02, by_lines ? 4 : 3);
}

}  // namespace
}  // namespace berth
