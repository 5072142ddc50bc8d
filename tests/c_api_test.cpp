// include/berth.h against the C++ interface that it wraps.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <cstring>
#include <string>
#include <vector>

#include "berth.h"
#include "berth/detector.hpp"
#include "berth/pose_filter.hpp"
#include "berth/source.hpp"
#include "sim/scenario.hpp"
#include "support/c_handles.hpp"
#include "support/command_output.hpp"
#include "support/counted_allocations.hpp"
#include "support/scratch_folder.hpp"

namespace berth {
namespace {

using test::detector_of;
using test::empty;
using test::Handle;
using test::kSide_m;
using test::photo;
using test::settings_for;
using testing::ElementsAreArray;

const std::string kRoot = BERTH_SOURCE_DIR;

void expect_pose(const berth_pose& pose, const Pose& expected) {
  EXPECT_THAT(pose.R, ElementsAreArray(expected.R));
  EXPECT_THAT(pose.t, ElementsAreArray(expected.t));
}

void expect_estimate(const berth_pose_estimate& estimate, const Pose& pose, const PoseUncertainty& uncertainty) {
  expect_pose(estimate.pose, pose);
  EXPECT_EQ(estimate.has_covariance, 1);
  EXPECT_THAT(estimate.covariance, ElementsAreArray(uncertainty.covariance));
  EXPECT_EQ(estimate.error_px, uncertainty.error_px);
  EXPECT_EQ(estimate.ambiguity, uncertainty.ambiguity());
  ASSERT_EQ(estimate.has_other, uncertainty.has_other ? 1 : 0);
  if (!uncertainty.has_other) return;
  expect_pose(estimate.other, uncertainty.other);
  EXPECT_THAT(estimate.other_covariance, ElementsAreArray(uncertainty.other_covariance));
  EXPECT_EQ(estimate.other_error_px, uncertainty.other_error_px);
  EXPECT_EQ(estimate.other_excess, uncertainty.other_excess);
}

TEST(CApi, TheExamplePrintsThePose) {
  const GrayImage image = photo();
  const test::ScratchFolder folder;
  const std::string header = "P5\n" + std::to_string(image.width()) + " " + std::to_string(image.height()) + "\n255\n";
  const std::string pixels(reinterpret_cast<const char*>(image.view().data),
                           static_cast<std::size_t>(image.width()) * static_cast<std::size_t>(image.height()));
  const auto [text, status] =
      test::output_of(std::string(BERTH_C_EXAMPLE) + " " + folder.write("dock.pgm", header + pixels));
  EXPECT_EQ(status, 0);

  const auto backend = open_backend("simd");
  DetectorConfig config;
  config.camera = paper_camera(image.width(), image.height());
  config.marker_size_m = kSide_m;
  Detector detector(*backend, image.width(), image.height(), config);
  const Detection& marker = detector.detect(image.view()).detections.at(0);
  char line[100];
  std::snprintf(line, sizeof line, "tag36h11 7 at %.4f %.4f %.4f m\n", marker.pose.t[0], marker.pose.t[1],
                marker.pose.t[2]);
  EXPECT_EQ(text, line);
}

TEST(CApi, MarkersBundlesAndFilteredPosesAreTheCppInterfacesToTheBit) {
  const auto source = open_scenario(kRoot + "/scenarios/nested.toml");
  const CameraModel camera = *source->camera();
  DetectorConfig config;
  config.families.clear();
  config.camera = camera;
  config.bundles = read_bundles(kRoot + "/bundles/nested.yaml");
  for (const BundleMarker& marker : config.bundles.at(0).markers) config.families.push_back(marker.family->name);
  config.corner_method = CornerMethod::photometric;
  const auto backend = open_backend("simd");
  Detector detector(*backend, camera.width, camera.height, config);

  berth_error error{};
  const Handle<berth_settings> settings(berth_settings_new(&error));
  berth_camera lens = empty<berth_camera>();
  lens.width = camera.width;
  lens.height = camera.height;
  lens.fx = camera.fx;
  lens.fy = camera.fy;
  lens.cx = camera.cx;
  lens.cy = camera.cy;
  std::copy(camera.distortion.begin(), camera.distortion.end(), lens.distortion);
  berth_settings_set_camera(settings.get(), &lens, &error);
  for (const std::string& name : config.families) berth_settings_add_family(settings.get(), name.c_str(), &error);
  // The bundle by numbers, as the file has them.
  const Bundle& bundle = config.bundles.front();
  berth_settings_add_bundle(settings.get(), bundle.name.c_str(), bundle.deviation_m, &error);
  for (const BundleMarker& marker : bundle.markers) {
    berth_pose place;
    std::copy(marker.pose.R.begin(), marker.pose.R.end(), place.R);
    std::copy(marker.pose.t.begin(), marker.pose.t.end(), place.t);
    berth_settings_add_bundle_marker(settings.get(), marker.family->name.c_str(), marker.id, marker.size_m, &place,
                                     &error);
  }
  berth_settings_set_corner_method(settings.get(), BERTH_CORNERS_PHOTOMETRIC, &error);
  const Handle<berth_detector> twin = detector_of(settings.get(), camera.width, camera.height);

  const PoseFilterConfig filter_config{camera, bundle.markers.front().size_m};
  PoseFilter filter(filter_config);
  berth_filter_settings filter_settings = empty<berth_filter_settings>();
  filter_settings.camera = &lens;
  filter_settings.marker_size_m = filter_config.marker_size_m;
  const Handle<berth_filter> filter_twin(berth_filter_open(&filter_settings, &error));

  for (int i = 0; i < 3; ++i) {
    const SourceFrame frame = source->next().value();
    const FrameResult& result = detector.detect(frame.image.view(), frame.stamp);
    berth_stamp stamp = empty<berth_stamp>();
    stamp.sequence = frame.stamp.sequence;
    stamp.mid_exposure_ns = frame.stamp.mid_exposure_ns;
    berth_detector_detect(twin.get(), frame.image.view().data, static_cast<std::size_t>(camera.width), &stamp, &error);
    berth_frame said = empty<berth_frame>();
    berth_detector_frame(twin.get(), &said, &error);
    ASSERT_EQ(error.code, BERTH_OK) << error.message;
    EXPECT_EQ(said.status, BERTH_FRAME_OK);
    EXPECT_EQ(said.sequence, frame.stamp.sequence);
    EXPECT_EQ(said.mid_exposure_ns, frame.stamp.mid_exposure_ns);
    EXPECT_GT(said.corners_ns, 0);
    ASSERT_EQ(said.markers, result.detections.size());
    ASSERT_GT(said.markers, 0u);
    for (std::size_t k = 0; k < said.markers; ++k) {
      const Detection& d = result.detections[k];
      berth_marker marker = empty<berth_marker>();
      ASSERT_EQ(berth_detector_marker(twin.get(), k, &marker, &error), BERTH_OK);
      EXPECT_EQ(marker.family, d.family->name);
      EXPECT_EQ(marker.id, d.id);
      EXPECT_EQ(marker.hamming, d.hamming);
      EXPECT_EQ(marker.margin, d.margin);
      for (std::size_t c = 0; c < 4; ++c) EXPECT_THAT(marker.corners[c], ElementsAreArray(d.corners[c]));
      EXPECT_THAT(marker.center, ElementsAreArray(d.center));
      EXPECT_THAT(marker.corner_covariance, ElementsAreArray(*d.corner_covariance_px2));
      EXPECT_EQ(marker.corners_fitted, d.corner_fit ? 1 : 0);
      EXPECT_EQ(marker.has_pose, d.has_pose ? 1 : 0);
      if (d.has_pose) expect_estimate(marker.pose, d.pose, *d.pose_uncertainty);
    }
    ASSERT_EQ(said.bundles, 1u);
    berth_bundle_pose board = empty<berth_bundle_pose>();
    berth_detector_bundle(twin.get(), 0, &board, &error);
    EXPECT_EQ(board.name, bundle.name);
    ASSERT_EQ(board.has_pose, 1);
    EXPECT_EQ(board.used, result.bundles[0].used);
    expect_estimate(board.pose, result.bundles[0].pose, result.bundles[0].uncertainty);

    const Detection& seen = result.detections.front();
    berth_marker marker = empty<berth_marker>();
    berth_detector_marker(twin.get(), 0, &marker, &error);
    const FilteredPose& expected = filter.update(frame.stamp.mid_exposure_ns, &seen);
    berth_filtered_pose filtered = empty<berth_filtered_pose>();
    berth_filter_update(filter_twin.get(), frame.stamp.mid_exposure_ns, &marker, &filtered, &error);
    ASSERT_EQ(error.code, BERTH_OK) << error.message;
    EXPECT_EQ(filtered.has_pose, 1);
    EXPECT_EQ(filtered.measured, expected.measured ? 1 : 0);
    expect_pose(filtered.pose, expected.pose);
    EXPECT_THAT(filtered.covariance, ElementsAreArray(expected.covariance));
    EXPECT_THAT(filtered.velocity, ElementsAreArray(expected.velocity));
    EXPECT_THAT(filtered.velocity_covariance, ElementsAreArray(expected.velocity_covariance));
  }
  const std::int64_t later = 1'000'000'000;
  berth_filtered_pose foretold = empty<berth_filtered_pose>();
  berth_filter_foretell(filter_twin.get(), later, &foretold, &error);
  expect_pose(foretold.pose, filter.foretell(later).pose);
  EXPECT_EQ(foretold.measured, 0);
  berth_filter_reset(filter_twin.get(), &error);
  berth_filter_foretell(filter_twin.get(), later, &foretold, &error);
  EXPECT_EQ(foretold.has_pose, 0);
}

TEST(CApi, ATargetOfDiscsHasThePoseOfTheCppInterface) {
  const auto source = open_scenario(kRoot + "/scenarios/port.toml");
  const CameraModel camera = *source->camera();
  DetectorConfig config;
  config.camera = camera;
  config.disc_targets = {read_disc_target(kRoot + "/targets/port.yaml")};
  const auto backend = open_backend("simd");
  Detector detector(*backend, camera.width, camera.height, config);
  const SourceFrame frame = source->next().value();
  const DiscPose& expected = detector.detect(frame.image.view()).disc_targets.at(0);
  ASSERT_TRUE(expected.has_pose);

  berth_error error{};
  const test::ScratchFolder folder;
  write_camera_info(folder / "camera.yaml", camera);
  berth_camera lens = empty<berth_camera>();
  berth_camera_read(&lens, (folder / "camera.yaml").c_str(), &error);
  const Handle<berth_settings> settings(berth_settings_new(&error));
  berth_settings_set_camera(settings.get(), &lens, &error);
  berth_settings_read_target(settings.get(), (kRoot + "/targets/port.yaml").c_str(), &error);
  const Handle<berth_detector> twin = detector_of(settings.get(), camera.width, camera.height);
  berth_detector_detect(twin.get(), frame.image.view().data, static_cast<std::size_t>(camera.width), nullptr, &error);
  berth_target_pose target = empty<berth_target_pose>();
  berth_detector_target(twin.get(), 0, &target, &error);
  ASSERT_EQ(error.code, BERTH_OK) << error.message;
  EXPECT_EQ(target.name, config.disc_targets[0].name);
  EXPECT_EQ(target.has_pose, 1);
  EXPECT_EQ(target.used, expected.used);
  expect_estimate(target.pose, expected.pose, expected.uncertainty);
}

TEST(CApi, RowsMayBeFurtherApartThanTheyAreLong) {
  const GrayImage image = photo();
  const std::size_t width = static_cast<std::size_t>(image.width()), stride = width + 13;
  std::vector<u8> padded(stride * static_cast<std::size_t>(image.height()), 255);
  for (int y = 0; y < image.height(); ++y) {
    std::memcpy(&padded[static_cast<std::size_t>(y) * stride], image.view().row(y), width);
  }
  const Handle<berth_settings> settings = settings_for(image.width(), image.height());
  const Handle<berth_detector> detector = detector_of(settings.get(), image.width(), image.height());
  berth_marker near_marker = empty<berth_marker>(), far_marker = empty<berth_marker>();
  berth_detector_detect(detector.get(), image.view().data, width, nullptr, nullptr);
  ASSERT_EQ(berth_detector_marker(detector.get(), 0, &near_marker, nullptr), BERTH_OK);
  berth_detector_detect(detector.get(), padded.data(), stride, nullptr, nullptr);
  ASSERT_EQ(berth_detector_marker(detector.get(), 0, &far_marker, nullptr), BERTH_OK);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_THAT(far_marker.corners[i], ElementsAreArray(near_marker.corners[i]));
}

TEST(CApi, FramesAllocateNothingAndMarkersThatAreFollowedNeitherDo) {
  // So much larger than the marker that a window is worth it.
  GrayImage image(960, 720);
  std::fill_n(image.view().data, 960 * 720, u8{128});
  const GrayImage middle = photo();
  for (int y = 0; y < middle.height(); ++y) std::memcpy(image.view().row(y + 240) + 320, middle.view().row(y), 320);
  const Handle<berth_settings> settings = settings_for(image.width(), image.height());
  ASSERT_EQ(berth_settings_set_tracking(settings.get(), 100, nullptr), BERTH_OK);
  const Handle<berth_detector> detector = detector_of(settings.get(), image.width(), image.height());
  EXPECT_GT(berth_detector_device_bytes(detector.get()), 0u);
  berth_error error{};
  berth_stamp stamp = empty<berth_stamp>();
  berth_frame frame = empty<berth_frame>();
  berth_marker marker = empty<berth_marker>();
  const auto look = [&](int count) {
    for (int i = 0; i < count; ++i) {
      stamp.mid_exposure_ns += 10'000'000;
      berth_detector_detect(detector.get(), image.view().data, static_cast<std::size_t>(image.width()), &stamp, &error);
      berth_detector_frame(detector.get(), &frame, &error);
      berth_detector_marker(detector.get(), 0, &marker, &error);
    }
  };
  look(2);
  const std::size_t before = test::allocations();
  look(10);
  EXPECT_EQ(test::allocations(), before);
  ASSERT_EQ(error.code, BERTH_OK) << error.message;
  EXPECT_EQ(frame.whole, 0);
  EXPECT_EQ(marker.id, 7);
}

}  // namespace
}  // namespace berth
