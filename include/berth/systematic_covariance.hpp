#pragma once

#include <array>

#include "berth/camera.hpp"
#include "berth/marker.hpp"

namespace berth {

/// One standard deviation of what a pose takes for granted, each independent of the others.
struct CalibrationDeviation {
  /// px
  double fx = 0, fy = 0, cx = 0, cy = 0;
  /// In the order of CameraModel::distortion.
  std::array<double, 8> distortion = {};
  /// Of the marker's side, m.
  double marker_size_m = 0;
};

/// What errors of calibration and of the marker's size make of a marker's pose: a covariance as PoseUncertainty's, of
/// an error that is the same in every frame that shows the marker at the same place. It adds to a frame's covariance,
/// and no filter averages it away. Returns false, and leaves `covariance` alone, where the marker has no pose.
bool systematic_covariance(const CameraModel& camera, double marker_size_m, const Detection& marker,
                           const CalibrationDeviation& deviation, std::array<double, 36>& covariance);

}  // namespace berth
