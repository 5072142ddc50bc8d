#pragma once

#include <array>

#include "berth/camera.hpp"
#include "berth/marker.hpp"

namespace berth {

/// Both poses a square of side `size_m` may have, from its corners (paper's order, px, distorted): a plane seen from
/// far away looks nearly the same tilted either way. Returns how many there are, 0 to 2. The order means nothing; where
/// noise is small one of them fits far better (refine_pose). Marker frame: docs/coordinate-frames.md.
/// Collins and Bartoli, "Infinitesimal Plane-Based Pose Estimation", IJCV 2014.
int planar_poses(const CameraModel& camera, double size_m, const std::array<std::array<double, 2>, 4>& corners_px,
                 std::array<Pose, 2>& poses);

}  // namespace berth
