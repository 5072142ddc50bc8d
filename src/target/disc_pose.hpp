#pragma once

#include <array>
#include <cstddef>

#include "berth/camera.hpp"
#include "berth/disc_target.hpp"
#include "target/disc_fit.hpp"
#include "target/refine_pose.hpp"

namespace berth {

/// A disc of a target and how it was seen.
struct SeenDisc {
  TargetDisc disc;
  FittedDisc fitted;
};

/// The ellipse that a disc's outline is in the camera's plane z = 1; false where part of it is not before the camera.
/// From the outline's dual conic, P Pᵀ - r² (I - n nᵀ), with its centre P, radius r and normal n in the camera frame.
bool disc_ellipse(const Pose& pose, const TargetDisc& disc, Ellipse& ellipse);

/// Least squares of the ellipses' centres from a pose nearby: seen ones less those that the discs' outlines have at the
/// pose, weighted by their covariances with `deviation_m` of the discs' places added (DiscTarget). As refine_pose.
bool refine_disc_pose(const SeenDisc* discs, std::size_t count, double deviation_m, const Pose& start,
                      RefinedPose& result);

/// How far a seen centre lies off where the pose puts it, px.
double center_error_px(const FittedDisc& seen, const Ellipse& expected);

}  // namespace berth
