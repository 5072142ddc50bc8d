// The survey: markers come back where they are, within what it says of itself, from exact projections with noise and
// from frames that the simulator renders; and it refuses what cannot be told, with the reason.
#include "survey/survey.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>

#include "berth/bundle.hpp"
#include "berth/detector.hpp"
#include "sim/geometry.hpp"
#include "sim/scenario.hpp"
#include "support/command_run.hpp"
#include "support/marker_scene.hpp"
#include "support/scratch_folder.hpp"
#include "target/marker_pose.hpp"

namespace berth {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

CameraModel fisheye_camera() {
  CameraModel camera = paper_camera();
  camera.fx = 402;
  camera.fy = 401;
  camera.lens = LensModel::equidistant;
  camera.distortion = {-0.03, 0.012, -0.006, 0.001};
  return camera;
}

BundleMarker marker(int id, double size_m, const Vec3& at, const Vec3& degrees) {
  BundleMarker marker = {&family("tag36h11"), id, size_m, {}};
  marker.pose = translation(at[0], at[1], at[2]);
  marker.pose.R = sim::rotation(radians(degrees[0]), radians(degrees[1]), radians(degrees[2]));
  return marker;
}

/// Two markers on each of a box's front, right face and top.
std::vector<BundleMarker> box() {
  return {marker(0, 0.05, {-0.045, 0, 0}, {0, 0, 0}),        marker(1, 0.05, {0.045, 0.03, 0}, {0, 0, 20}),
          marker(2, 0.05, {0.1, -0.04, 0.05}, {0, -90, 0}),  marker(3, 0.05, {0.1, 0.05, 0.06}, {0, -90, 0}),
          marker(4, 0.04, {-0.05, -0.1, 0.04}, {-90, 0, 0}), marker(5, 0.04, {0.04, -0.1, 0.06}, {-90, 0, 0})};
}

SurveyOptions box_options() {
  SurveyOptions options;
  options.size_m = 0.05;
  options.sizes_m = {{4, 0.04}, {5, 0.04}};
  return options;
}

/// The marker as the camera has it: exact corners with noise. None where it shows its back or is not wholly inside.
std::optional<Detection> seen(const CameraModel& camera, const Pose& body, const BundleMarker& marker, double noise_px,
                              Random& random) {
  const Pose pose = compose(body, marker.pose);
  Detection detection;
  detection.family = marker.family;
  detection.id = marker.id;
  if (dot(column(pose.R, 2), pose.t) < 0.25 * length(pose.t)) return std::nullopt;
  const auto places = corner_places(marker.size_m);
  for (std::size_t k = 0; k < 4; ++k) {
    detection.corners[k] = image_of(camera, transform(pose, places[k]));
    for (double& value : detection.corners[k]) value += noise_px * random.normal();
    const auto& [x, y] = detection.corners[k];
    if (x < 1 || y < 1 || x > camera.width - 2 || y > camera.height - 2) return std::nullopt;
  }
  // With covariances of their own the corners count as not from lines, whose bound is wider.
  const double variance = noise_px * noise_px;
  detection.corner_fit.emplace();
  detection.corner_covariance_px2 = independent_corners(std::sqrt(variance));
  return detection;
}

Pose some_view(int index, double tilt_deg, Random& random) {
  const double range = random.between(0.4, 0.6);
  Pose pose = translation(random.between(-0.1, 0.1) * range, random.between(-0.08, 0.08) * range, range);
  const double way = 2.4 * index, tilt = radians(random.between(0.4 * tilt_deg, tilt_deg));
  pose.R = product(sim::rotation(tilt * std::cos(way), tilt * std::sin(way), 0),
                   sim::rotation(0, 0, random.between(-0.4, 0.4)));
  return pose;
}

SurveyFrame frame_of(const CameraModel& camera, const Pose& body, const std::vector<BundleMarker>& markers,
                     double noise_px, Random& random) {
  SurveyFrame frame;
  for (const BundleMarker& marker : markers) {
    if (std::optional<Detection> detection = seen(camera, body, marker, noise_px, random)) {
      frame.markers.push_back(*detection);
    }
  }
  return frame;
}

std::vector<SurveyFrame> noisy_frames(const CameraModel& camera, const std::vector<BundleMarker>& markers, int count,
                                      double noise_px, Random& random, double tilt_deg = 55) {
  std::vector<SurveyFrame> frames;
  for (int f = 0; f < count; ++f) {
    frames.push_back(frame_of(camera, some_view(f, tilt_deg, random), markers, noise_px, random));
    frames.back().label = "frame " + std::to_string(f);
  }
  return frames;
}

SurveyFrames gathered(const std::vector<SurveyFrame>& frames) {
  SurveyFrames set(640, 300);
  for (const SurveyFrame& frame : frames) set.add(frame);
  return set;
}

/// True places in the frame of the survey's origin.
Pose true_place(const std::vector<BundleMarker>& truth, const Survey& survey, std::size_t m) {
  const auto pose_of = [&](int id) {
    for (const BundleMarker& marker : truth) {
      if (marker.id == id) return marker.pose;
    }
    ADD_FAILURE() << "no marker " << id;
    return Pose{};
  };
  const std::vector<BundleMarker>& found = survey.bundle.markers;
  return compose(inverse(pose_of(found[survey.origin].id)), pose_of(found[m].id));
}

/// Errors in the order of SurveyedMarker::deviations, m and degrees.
std::array<double, 6> errors_of(const std::vector<BundleMarker>& truth, const Survey& survey, std::size_t m) {
  std::array<double, 6> errors = step_between(true_place(truth, survey, m), survey.bundle.markers[m].pose);
  for (std::size_t i = 3; i < 6; ++i) errors[i] *= kDegrees;
  return errors;
}

/// Each axis within so many of the reported standard deviations, and so many metres and degrees.
void expect_recovered(const std::vector<BundleMarker>& truth, const Survey& survey, double within_m, double within_deg,
                      double deviations = 3) {
  EXPECT_THAT(survey.objections, IsEmpty());
  ASSERT_EQ(survey.bundle.markers.size(), truth.size());
  for (std::size_t m = 0; m < truth.size(); ++m) {
    const std::array<double, 6> errors = errors_of(truth, survey, m);
    for (std::size_t i = 0; i < 6; ++i) {
      const double deviation = survey.markers[m].deviations[i];
      if (m == survey.origin) {
        EXPECT_EQ(errors[i], 0);
        EXPECT_EQ(deviation, 0);
        continue;
      }
      EXPECT_GT(deviation, 0);
      EXPECT_LT(std::fabs(errors[i]), deviations * deviation) << survey.bundle.markers[m].id << " axis " << i;
      EXPECT_LT(std::fabs(errors[i]), i < 3 ? within_m : within_deg) << survey.bundle.markers[m].id << " axis " << i;
    }
  }
}

class EveryLens : public testing::TestWithParam<LensModel> {
 public:
  static CameraModel camera() { return GetParam() == LensModel::equidistant ? fisheye_camera() : paper_camera(); }
};
INSTANTIATE_TEST_SUITE_P(Lenses, EveryLens, testing::Values(LensModel::radial_tangential, LensModel::equidistant),
                         [](const auto& lens) { return lens.param == LensModel::equidistant ? "fisheye" : "brown"; });

TEST_P(EveryLens, PlacesMarkersOnABox) {
  Random random(3);
  const Survey found = survey(gathered(noisy_frames(camera(), box(), 40, 0.05, random)), camera(), box_options());
  expect_recovered(box(), found, 0.0003, 0.3);
  EXPECT_EQ(found.rejected, 0);
  EXPECT_NEAR(found.rms_px, 0.05 * std::sqrt(2), 0.02);  // of both coordinates, a third taken up by the cameras' poses
}

// Under a sanitizer a set takes six seconds.
#if defined(__SANITIZE_ADDRESS__) || defined(__SANITIZE_THREAD__)
constexpr int kSets = 4;
#else
constexpr int kSets = 20;
#endif

// Errors over their standard deviations have mean square 1: sets of frames, 5 markers, 6 axes.
TEST_P(EveryLens, KnowsHowWellItKnows) {
  Random random(8);
  double squares = 0;
  int count = 0;
  for (int set = 0; set < kSets; ++set) {
    const Survey found = survey(gathered(noisy_frames(camera(), box(), 35, 0.1, random)), camera(), box_options());
    ASSERT_THAT(found.objections, IsEmpty());
    for (std::size_t m = 0; m < found.markers.size(); ++m) {
      if (m == found.origin) continue;
      const std::array<double, 6> errors = errors_of(box(), found, m);
      for (std::size_t i = 0; i < 6; ++i) {
        squares += errors[i] * errors[i] / (found.markers[m].deviations[i] * found.markers[m].deviations[i]);
        ++count;
      }
    }
  }
  ASSERT_EQ(count, kSets * 30);
  // The markers of a set share errors: the mean square of 20 sets scatters by some 0.09, not by the 0.06 of independent
  // ones.
  EXPECT_NEAR(squares / count, 1, 3 * 0.09 * std::sqrt(20.0 / kSets));
}

TEST(Survey, TakesTheOriginAskedFor) {
  Random random(4);
  const SurveyFrames frames = gathered(noisy_frames(paper_camera(), box(), 30, 0.05, random));
  SurveyOptions options = box_options();
  const Survey chosen = survey(frames, paper_camera(), options);
  EXPECT_THAT(chosen.bundle.markers[chosen.origin].id, testing::AnyOf(0, 1));  // on the front, which all frames show
  options.origin = 4;
  const Survey asked = survey(frames, paper_camera(), options);
  EXPECT_EQ(asked.bundle.markers[asked.origin].id, 4);
  expect_recovered(box(), asked, 0.001, 1);
  options.origin = 9;
  EXPECT_THAT(
      survey(frames, paper_camera(), options).objections,
      ElementsAre(HasSubstr("marker 9, was seen with others in fewer than 3 frames; choose another of tag36h11 0")));
}

TEST(Survey, FindsSizesThatAreFree) {
  Random random(6);
  const SurveyFrames frames = gathered(noisy_frames(paper_camera(), box(), 40, 0.05, random));
  SurveyOptions options;
  options.size_m = 0.05;  // 4 and 5 have 0.04; of the others some are given wrong
  options.sizes_m = {{1, 0.06}, {3, 0.04}};
  options.origin = 0;
  const Survey fixed = survey(frames, paper_camera(), options);
  EXPECT_FALSE(fixed.objections.empty());
  options.free_sizes = true;
  const Survey free = survey(frames, paper_camera(), options);
  expect_recovered(box(), free, 0.001, 0.5);
  for (std::size_t m = 1; m < free.markers.size(); ++m) {
    const double deviation = free.markers[m].size_deviation_m;
    EXPECT_GT(deviation, 0);
    EXPECT_LT(deviation, 0.0002);
    EXPECT_NEAR(free.bundle.markers[m].size_m, m < 4 ? 0.05 : 0.04, 3 * deviation) << m;
  }
  EXPECT_EQ(free.bundle.markers[0].size_m, 0.05);
}

TEST(Survey, RejectsWhatIsWrong) {
  Random random(5);
  std::vector<SurveyFrame> frames = noisy_frames(paper_camera(), box(), 40, 0.05, random);
  // A marker read where another thing is, one read upside down, and a corner that something covers.
  for (auto& corner : frames[3].markers[1].corners) corner[0] += 20;
  auto& turned = frames[7].markers[0].corners;
  std::rotate(turned.begin(), turned.begin() + 2, turned.end());
  frames[11].markers[0].corners[2][1] += 3;
  const Survey found = survey(gathered(frames), paper_camera(), box_options());
  expect_recovered(box(), found, 0.0003, 0.3);
  EXPECT_EQ(found.rejected, 9);
}

TEST(Survey, LeavesOutWhatIsSeenTooSeldom) {
  Random random(5);
  std::vector<SurveyFrame> frames = noisy_frames(paper_camera(), box(), 30, 0.05, random);
  frames[2].markers.push_back(frames[2].markers[0]);
  frames[2].markers.back().id = 77;
  const Survey found = survey(gathered(frames), paper_camera(), box_options());
  expect_recovered(box(), found, 0.001, 1);
  EXPECT_THAT(found.notes,
              ElementsAre("tag36h11 77 is left out: it was seen with others in 1 of the 3 frames it takes"));
}

TEST(Survey, RefusesTheUnconnectedByName) {
  Random random(5);
  const std::vector<BundleMarker> all = box(), front(all.begin(), all.begin() + 2), top(all.begin() + 4, all.end());
  std::vector<SurveyFrame> frames = noisy_frames(paper_camera(), front, 10, 0.05, random);
  for (SurveyFrame& frame : noisy_frames(paper_camera(), top, 30, 0.05, random)) frames.push_back(frame);
  EXPECT_THAT(
      survey(gathered(frames), paper_camera(), box_options()).objections,
      ElementsAre(HasSubstr("unconnected: tag36h11 4, tag36h11 5 and tag36h11 0, tag36h11 1 share fewer than 2")));
}

TEST(Survey, RefusesTooFewFramesAndOneViewDirection) {
  Random random(5);
  EXPECT_THAT(
      survey(gathered(noisy_frames(paper_camera(), box(), 4, 0.05, random)), paper_camera(), box_options()).objections,
      ElementsAre(HasSubstr("too few frames: 4 of the 5")));
  const std::vector<BundleMarker> all = box(), front(all.begin(), all.begin() + 2);
  std::vector<SurveyFrame> frontal;
  for (int f = 0; f < 20; ++f) {
    Pose pose = translation(0, 0, 0.3 + 0.01 * f);
    pose.R = sim::rotation(0.3, 0.2, 0);
    frontal.push_back(frame_of(paper_camera(), pose, front, 0.05, random));
  }
  EXPECT_THAT(survey(gathered(frontal), paper_camera(), box_options()).objections,
              testing::Contains(HasSubstr("one view direction: the frames look from within")));
}

// A marker that moves halfway through fits no single place.
TEST(Survey, RefusesAMarkerThatMoves) {
  Random random(5);
  std::vector<BundleMarker> markers = box();
  std::vector<SurveyFrame> frames = noisy_frames(paper_camera(), markers, 20, 0.05, random);
  markers[1].pose.t[0] += 0.01;
  for (SurveyFrame& frame : noisy_frames(paper_camera(), markers, 20, 0.05, random)) frames.push_back(frame);
  EXPECT_THAT(survey(gathered(frames), paper_camera(), box_options()).objections,
              testing::Contains(HasSubstr("tag36h11 1 does not keep its place: it fits in 2")));
}

TEST(SurveyFrames, KeepsWhatTells) {
  Random random(5);
  const CameraModel camera = paper_camera();
  const std::vector<SurveyFrame> frames = noisy_frames(camera, box(), 30, 0.05, random);
  SurveyFrames all(640, 300);
  EXPECT_EQ(all.add(frames[0]), SurveyFrames::Verdict::taken);
  EXPECT_EQ(all.add(frames[0]), SurveyFrames::Verdict::repeated);
  SurveyFrame more = frames[0];  // from the same place, but with another marker
  more.markers.push_back(more.markers[0]);
  more.markers.back().id = 9;
  EXPECT_EQ(all.add(more), SurveyFrames::Verdict::taken);
  SurveyFrame alone = frames[1];
  alone.markers.resize(1);
  EXPECT_EQ(all.add(alone), SurveyFrames::Verdict::alone);
  SurveyFrame twice = alone;  // the same marker twice is none
  twice.markers.push_back(twice.markers[0]);
  EXPECT_EQ(all.add(twice), SurveyFrames::Verdict::alone);
  EXPECT_EQ(all.frames().size(), 2u);
  EXPECT_EQ(all.alone(), 2);
  EXPECT_EQ(all.repeated(), 1);

  SurveyFrames few(640, 12);
  few.add(more);
  for (const SurveyFrame& frame : frames) few.add(frame);
  EXPECT_LE(few.frames().size(), 12u);
  EXPECT_GE(few.frames().size(), 5u);
  EXPECT_EQ(few.frames()[0].markers.back().id, 9);  // the only one with 9
}

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
