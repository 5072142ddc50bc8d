#pragma once

#include <array>

#include "berth/camera.hpp"
#include "berth/marker.hpp"
#include "target/refine_pose.hpp"

namespace berth {

/// Of corners with one standard deviation of every coordinate, px, each independent of the others.
CornerCovariance independent_corners(double deviation_px);
/// The marker's own where it has one, else that.
CornerCovariance corner_covariance(const Detection& marker, double deviation_px);
/// Of one corner alone: of x, of x with y, of y.
std::array<double, 3> block_of(const CornerCovariance& covariance_px2, std::size_t corner);

/// Whether the camera sees the marker's front: its z axis points away then.
bool faces_camera(const Pose& marker);

/// A marker's four corners (paper's order) as refine_pose takes them; with none where that is no covariance.
SeenCorners seen_corners_of(double size_m, const std::array<std::array<double, 2>, 4>& corners_px,
                            const CornerCovariance& covariance_px2);

/// Pose of a square marker of side `size_m` from its corners (paper's order, px, distorted): both poses of a plane,
/// each refined, the one with the smaller chi-square, with what is known of it (docs/pose.md). Returns false when the
/// corners are degenerate or behind the camera.
bool marker_pose(const CameraModel& camera, double size_m, const std::array<std::array<double, 2>, 4>& corners_px,
                 const CornerCovariance& covariance_px2, Pose& pose, PoseUncertainty& uncertainty);
/// The same with one standard deviation of every coordinate, px.
bool marker_pose(const CameraModel& camera, double size_m, double deviation_px,
                 const std::array<std::array<double, 2>, 4>& corners_px, Pose& pose, PoseUncertainty& uncertainty);

}  // namespace berth
