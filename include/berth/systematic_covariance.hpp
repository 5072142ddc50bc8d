#pragma once

#include <array>
#include <optional>
#include <string>

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
  /// Of how far all sides of a marker lie too far out or in, px: what a bent tone curve or saturation makes of corners
  /// by edges (docs/corners.md).
  double edge_px = 0;
};

/// The deviations that `berth calibrate` writes into its camera file; none where a file has none. Throws Error naming
/// the file, the field and the remedy where they are wrong.
std::optional<CalibrationDeviation> read_calibration_deviation(const std::string& path);

/// Writes a ROS camera_info YAML file with them: readers that do not know the field pass it over. Throws Error when the
/// file cannot be written.
void write_camera_info(const std::string& path, const CameraModel& camera, const std::string& name,
                       const CalibrationDeviation& deviation);

/// What errors of calibration and of the marker's size make of a marker's pose: a covariance as PoseUncertainty's, of
/// an error that is the same in every frame that shows the marker at the same place. It adds to a frame's covariance,
/// and no filter averages it away. Returns false, and leaves `covariance` alone, where the marker has no pose.
bool systematic_covariance(const CameraModel& camera, double marker_size_m, const Detection& marker,
                           const CalibrationDeviation& deviation, std::array<double, 36>& covariance);

}  // namespace berth
