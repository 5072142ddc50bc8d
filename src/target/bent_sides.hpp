#pragma once

#include <array>

#include "berth/camera.hpp"

namespace berth {

/// How far from a marker's corners the detector's are, px, because it fits straight lines to sides that the lens bends:
/// found minus true. `rays`: the corners (x, y, 1) in the camera frame, in the order of Detection::corners. The lines
/// are fitted as kernels/edge_refine.inl does.
std::array<std::array<double, 2>, 4> bent_side_shift(const CameraModel& camera,
                                                     const std::array<std::array<double, 2>, 4>& rays);

/// From the detector's corners, px, to where the lens shows the marker's: takes that shift off.
void straighten_corners(const CameraModel& camera, std::array<std::array<double, 2>, 4>& corners_px);

}  // namespace berth
