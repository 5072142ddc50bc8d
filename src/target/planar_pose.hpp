#pragma once

#include <array>
#include <cstddef>

#include "berth/camera.hpp"
#include "berth/marker.hpp"

namespace berth {

/// Both poses a square of side `size_m` may have, from its corners (paper's order, px, distorted): a plane seen from
/// far away looks nearly the same tilted either way. Returns how many there are, 0 to 2. The order means nothing; where
/// noise is small one of them fits far better (refine_pose). Marker frame: docs/coordinate-frames.md.
/// Collins and Bartoli, "Infinitesimal Plane-Based Pose Estimation", IJCV 2014.
int planar_poses(const CameraModel& camera, double size_m, const std::array<std::array<double, 2>, 4>& corners_px,
                 std::array<Pose, 2>& poses);

/// The same of any points in the plane z = 0 of a target, m, seen at (x, y) of the camera's plane z = 1: from where the
/// target's origin is seen and how that moves with the target's x and y (dx/dX, dx/dY, dy/dX, dy/dY).
int planar_poses(const std::array<double, 2>& origin, const std::array<double, 4>& derivative,
                 const std::array<double, 3>* places_m, const std::array<double, 2>* seen, std::size_t count,
                 std::array<Pose, 2>& poses);

}  // namespace berth
