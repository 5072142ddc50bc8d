#pragma once

#include <array>

#include "berth/camera.hpp"
#include "berth/marker.hpp"
#include "target/refine_pose.hpp"

namespace berth {

/// Of each corner, px^2: of x, of x with y, of y.
using CornerCovariances = std::array<std::array<double, 3>, 4>;

/// The marker's own where its corners were fitted, else one standard deviation of every coordinate, px.
CornerCovariances corner_covariances(const Detection& marker, double deviation_px);

/// Whether the camera sees the marker's front: its z axis points away then.
bool faces_camera(const Pose& marker);

/// A marker's four corners (paper's order) as refine_pose takes them.
std::array<PoseCorner, 4> pose_corners(double size_m, const std::array<std::array<double, 2>, 4>& corners_px,
                                       const CornerCovariances& covariances_px2);

/// Pose of a square marker of side `size_m` from its corners (paper's order, px, distorted): both poses of a plane,
/// each refined, the one that fits better, with what is known of it (docs/pose.md). Returns false when the corners are
/// degenerate or behind the camera.
bool marker_pose(const CameraModel& camera, double size_m, const std::array<std::array<double, 2>, 4>& corners_px,
                 const CornerCovariances& covariances_px2, Pose& pose, PoseUncertainty& uncertainty);
/// The same with one standard deviation of every coordinate, px.
bool marker_pose(const CameraModel& camera, double size_m, double deviation_px,
                 const std::array<std::array<double, 2>, 4>& corners_px, Pose& pose, PoseUncertainty& uncertainty);

}  // namespace berth
