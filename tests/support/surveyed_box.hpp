#pragma once

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "berth/bundle.hpp"
#include "sim/geometry.hpp"
#include "survey/survey.hpp"
#include "target/marker_pose.hpp"

namespace berth::test {

/// A fisheye, far from straight sides.
inline CameraModel fisheye_camera() {
  CameraModel camera = paper_camera();
  camera.fx = 402;
  camera.fy = 401;
  camera.lens = LensModel::equidistant;
  camera.distortion = {-0.03, 0.012, -0.006, 0.001};
  return camera;
}

inline BundleMarker marker(int id, double size_m, const Vec3& at, const Vec3& degrees) {
  BundleMarker marker = {&family("tag36h11"), id, size_m, {}};
  marker.pose = translation(at[0], at[1], at[2]);
  marker.pose.R = sim::rotation(radians(degrees[0]), radians(degrees[1]), radians(degrees[2]));
  return marker;
}

/// Two markers on each of a box's front, right face and top.
inline std::vector<BundleMarker> box() {
  return {marker(0, 0.05, {-0.045, 0, 0}, {0, 0, 0}),        marker(1, 0.05, {0.045, 0.03, 0}, {0, 0, 20}),
          marker(2, 0.05, {0.1, -0.04, 0.05}, {0, -90, 0}),  marker(3, 0.05, {0.1, 0.05, 0.06}, {0, -90, 0}),
          marker(4, 0.04, {-0.05, -0.1, 0.04}, {-90, 0, 0}), marker(5, 0.04, {0.04, -0.1, 0.06}, {-90, 0, 0})};
}

inline SurveyOptions box_options() {
  SurveyOptions options;
  options.size_m = 0.05;
  options.sizes_m = {{4, 0.04}, {5, 0.04}};
  return options;
}

/// True places in the frame of the survey's origin.
inline Pose true_place(const std::vector<BundleMarker>& truth, const Survey& survey, std::size_t m) {
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
inline std::array<double, 6> errors_of(const std::vector<BundleMarker>& truth, const Survey& survey, std::size_t m) {
  std::array<double, 6> errors = step_between(true_place(truth, survey, m), survey.bundle.markers[m].pose);
  for (std::size_t i = 3; i < 6; ++i) errors[i] *= kDegrees;
  return errors;
}

/// Each axis within so many of the reported standard deviations, and so many metres and degrees.
inline void expect_recovered(const std::vector<BundleMarker>& truth, const Survey& survey, double within_m,
                             double within_deg, double deviations = 3) {
  EXPECT_THAT(survey.objections, testing::IsEmpty());
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

}  // namespace berth::test
