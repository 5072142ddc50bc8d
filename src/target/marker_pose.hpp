#pragma once

#include <array>

#include "berth/camera.hpp"
#include "berth/marker.hpp"

namespace berth {

/// Pose of a square marker of side `size_m` from its corners (paper's order, px, distorted): both poses of a plane,
/// each refined, the one that fits better, with what is known of it (docs/pose.md). `deviation_px` is a corner
/// coordinate's. Returns false when the corners are degenerate or behind the camera.
bool marker_pose(const CameraModel& camera, double size_m, double deviation_px,
                 const std::array<std::array<double, 2>, 4>& corners_px, Pose& pose, PoseUncertainty& uncertainty);

}  // namespace berth
