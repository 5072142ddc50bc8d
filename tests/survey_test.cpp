// The survey: markers come back where they are, within what it says of itself, from exact projections with noise; and
// it refuses what cannot be told, with the reason.
#include "survey/survey.hpp"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <optional>
#include <string>
#include <vector>

#include "support/marker_scene.hpp"
#include "support/surveyed_box.hpp"

namespace berth {
namespace {

using test::box;
using test::box_options;
using test::errors_of;
using test::expect_recovered;
using test::fisheye_camera;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

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

}  // namespace
}  // namespace berth
