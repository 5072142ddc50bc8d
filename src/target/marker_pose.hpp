#pragma once

#include <array>

#include "berth/camera.hpp"
#include "berth/marker.hpp"
#include "target/refine_pose.hpp"

namespace berth {

/// A marker's four corners as refine_pose takes them, every coordinate with the same deviation.
std::array<PoseCorner, 4> pose_corners(double size_m, double deviation_px,
                                       const std::array<std::array<double, 2>, 4>& corners_px);

/// Pose of a square marker of side `size_m` from its corners (paper's order, px, distorted): both poses of a plane,
/// each refined, the one that fits better, with what is known of it (docs/pose.md). `deviation_px` is a corner
/// coordinate's. Returns false when the corners are degenerate or behind the camera.
bool marker_pose(const CameraModel& camera, double size_m, double deviation_px,
                 const std::array<std::array<double, 2>, 4>& corners_px, Pose& pose, PoseUncertainty& uncertainty);

}  // namespace berth
