#pragma once

#include <array>

#include "berth/camera.hpp"
#include "berth/marker.hpp"

namespace berth {

/// The paper's closed-form P4P (section 4.1, equations 1–5): pose of a square marker of side `size_m` from its four
/// corners (paper's order, px, distorted). Marker frame: see docs/coordinate-frames.md. Returns false when the corners
/// are degenerate or behind the camera.
bool paper_p4p(const CameraModel& camera, double size_m, const std::array<std::array<double, 2>, 4>& corners_px,
               Pose& pose);

}  // namespace berth
