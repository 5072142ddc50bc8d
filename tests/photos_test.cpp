// Real photographs with known markers. They lie outside the repository (BERTH_SHARED_DATA) and are not always there.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <opencv2/imgcodecs.hpp>

#include "berth/backend.hpp"
#include "berth/detector.hpp"

namespace berth {
namespace {

using Corners = std::array<std::array<double, 2>, 4>;

std::string shared_data() {
  const char* from_environment = std::getenv("BERTH_SHARED_DATA");
  return from_environment != nullptr ? from_environment : BERTH_SHARED_DATA_DEFAULT;
}

std::vector<Detection> detect(const std::string& path, const std::string& backend) {
  const cv::Mat picture = cv::imread(path, cv::IMREAD_GRAYSCALE);
  EXPECT_FALSE(picture.empty()) << path;
  const std::unique_ptr<Backend> device = open_backend(backend);
  Detector detector(*device, picture.cols, picture.rows, {});
  return detector.detect({picture.data, picture.cols, picture.rows, static_cast<int>(picture.step)}).detections;
}

/// The greatest distance between corresponding corners.
double distance(const Corners& a, const Corners& b) {
  double most = 0;
  for (std::size_t k = 0; k < 4; ++k) most = std::max(most, std::hypot(a[k][0] - b[k][0], a[k][1] - b[k][1]));
  return most;
}

double distance_to_nearest(const Corners& corners, int id, const std::vector<Detection>& detections) {
  double best = 1e9;
  for (const Detection& detection : detections) {
    if (detection.id == id) best = std::min(best, distance(corners, detection.corners));
  }
  return best;
}

struct Expected {
  int id;
  Corners corners;
};

/// `id, (x y) ×4` a line, corners counter-clockwise from the lower left, pixel centres at halves.
std::vector<Expected> read_expected(const std::string& path) {
  std::vector<Expected> all;
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    std::replace_if(
        line.begin(), line.end(), [](char c) { return c == ',' || c == '(' || c == ')'; }, ' ');
    std::istringstream words(line);
    Expected expected{};
    words >> expected.id;
    for (std::size_t k = 0; k < 4; ++k) {
      std::array<double, 2>& corner = expected.corners[(k + 1) % 4];
      words >> corner[0] >> corner[1];
      corner[0] -= 0.5;
      corner[1] -= 0.5;
    }
    all.push_back(expected);
  }
  return all;
}

class ApriltagPhoto : public ::testing::TestWithParam<std::string> {};

// The listed corners are AprilTag's own, of markers of 12 to 34 px; where its edge fit gave up they are whole numbers.
// All but two of the 148 lie within 1 px of Berth's, those two within 1.05.
constexpr double kNear = 1.1;

TEST_P(ApriltagPhoto, EveryListedMarkerIsFoundNearby) {
  const std::string stem = shared_data() + "/apriltag/" + GetParam();
  if (!std::filesystem::exists(stem + ".jpg")) GTEST_SKIP() << stem << ".jpg is not here";
  const std::vector<Detection> detections = detect(stem + ".jpg", "simd");
  const std::vector<Expected> expected = read_expected(stem + ".txt");
  ASSERT_GE(expected.size(), 12u);
  for (const Expected& marker : expected) {
    EXPECT_LT(distance_to_nearest(marker.corners, marker.id, detections), kNear)
        << "id " << marker.id << " with its upper left at " << marker.corners[0][0] << ", " << marker.corners[0][1];
  }
  // The markers in these pictures are all of id 0: another id would be a code read where there is none.
  for (const Detection& detection : detections) EXPECT_EQ(detection.id, 0) << detection.center[0];
}

INSTANTIATE_TEST_SUITE_P(Photos, ApriltagPhoto,
                         ::testing::Values("33369213973_9d9bb4cc96_c", "34085369442_304b6bafd9_c"));

TEST(Photos, EveryRequiredMarkerIsFoundAndNothingElse) {
  const std::string folder = shared_data() + "/photos/";
  std::ifstream file(folder + "photos.json");
  if (!file) GTEST_SKIP() << folder << "photos.json is not here";
  const nlohmann::json photos = nlohmann::json::parse(file);
  for (const nlohmann::json& photo : photos) {
    const std::string name = photo.at("image");
    SCOPED_TRACE(name);
    const cv::Mat picture = cv::imread(folder + name, cv::IMREAD_GRAYSCALE);
    ASSERT_FALSE(picture.empty());
    const std::unique_ptr<Backend> device = open_backend("simd");
    DetectorConfig config;
    config.families = {photo.at("family").get<std::string>()};
    Detector detector(*device, picture.cols, picture.rows, config);
    const std::vector<Detection>& detections =
        detector.detect({picture.data, picture.cols, picture.rows, static_cast<int>(picture.step)}).detections;
    std::vector<int> listed;
    // The list has what its detector saw; these fields have markers 1 to 8, all of which were checked by eye.
    if (name == "162_36_Angle.png") listed = {5, 6, 7, 8};
    if (name == "383_60_Angle1.png") listed = {1, 2, 3};
    for (const nlohmann::json& tag : photo.at("tags")) {
      listed.push_back(tag.at("id"));
      if (!tag.at("required").get<bool>()) continue;
      // Upper left, upper right, lower right, lower left.
      Corners corners{};
      for (std::size_t k = 0; k < 4; ++k) {
        corners[(4 - k) % 4] = {tag.at("corners")[k][0].get<double>(), tag.at("corners")[k][1].get<double>()};
      }
      EXPECT_LT(distance_to_nearest(corners, tag.at("id"), detections), 2.0) << "id " << tag.at("id");
    }
    for (const Detection& detection : detections) {
      EXPECT_GE(std::count(listed.begin(), listed.end(), detection.id), 1)
          << "id " << detection.id << " at " << detection.center[0] << ", " << detection.center[1];
    }
  }
}

TEST(Photos, EveryBackendFindsTheSame) {
  const std::string path = shared_data() + "/photos/tag1_640_480.jpg";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not here";
  const std::vector<Detection> expected = detect(path, "reference");
  ASSERT_EQ(expected.size(), 1u);
  for (const BackendStatus& status : probe_backends()) {
    if (status.devices.empty()) continue;
    const std::vector<Detection> found = detect(path, status.name);
    ASSERT_EQ(found.size(), expected.size()) << status.name;
    EXPECT_EQ(found[0].corners, expected[0].corners) << status.name;
  }
}

}  // namespace
}  // namespace berth
