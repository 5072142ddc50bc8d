#pragma once

#include <array>

#include "berth/camera.hpp"
#include "berth/marker.hpp"

namespace berth {

/// How far from a marker's corners the detector's are, px, because it fits straight lines to sides that the lens bends:
/// found minus true, in the order of Detection::corners. `marker` takes marker points (docs/coordinate-frames.md) to
/// the camera frame. The lines are fitted as kernels/edge_refine.inl does.
std::array<std::array<double, 2>, 4> bent_side_shift(const CameraModel& camera, const Pose& marker, double size_m);

}  // namespace berth
