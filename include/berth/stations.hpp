#pragma once

#include <array>

#include "berth/camera.hpp"
#include "berth/marker.hpp"

namespace berth {

/// A camera on one vehicle and the marker on the other that it sees. "Vehicle": the robot or the dock.
struct Station {
  CameraModel lens;
  /// Camera frame to the frame of the vehicle that carries it.
  Pose camera;
  /// Marker frame to the frame of the vehicle that carries that, and the marker's side, m.
  Pose marker;
  double marker_size_m = 0;
  /// One standard deviation of a corner's coordinate, px, of markers without a covariance of their own.
  double corner_deviation_px = 0.15;
};

/// Two stations that look at each other.
struct StationPair {
  /// The robot's camera, the dock's marker; the dock's camera, the robot's marker.
  Station robot, dock;
};

/// Where the robot is.
struct RelativePose {
  /// Robot frame to dock frame.
  Pose pose;
  /// Its axes are the dock's; error_px is over all corners.
  PoseUncertainty uncertainty;
  /// Stations that went into it.
  int views = 0;
  /// Of both: what it costs the corners to have one pose instead of one each, in squares of standard deviations.
  /// Chi-square of 6 degrees of freedom where cameras, markers and mounts are where they are said to be: above 28 in
  /// one frame of 10,000.
  double disagreement = 0;
  /// Of both: translation (m) and turn (rad), dock's axes, from where the robot's camera alone puts the robot to where
  /// the dock's alone does, each with the solution that is nearer to `pose`.
  std::array<double, 6> difference = {};
};

/// The robot's pose from what one station's detector says, or both; null where a station does not see its marker. With
/// both: the least squares of all eight corners' reprojection errors in both images, from every pair of solutions of
/// the two planes. Both images must be of one time. A view without a pose and its uncertainty
/// (PoseMethod::least_squares), or whose corners' covariance is none (not positive definite), counts as null. Returns
/// false, and leaves `result` alone, where no view is left or the corners do not determine a pose.
bool relative_pose(const StationPair& stations, const Detection* robot, const Detection* dock, RelativePose& result);

}  // namespace berth
