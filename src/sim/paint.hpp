#pragma once

#include <vector>

#include "sim/lens.hpp"
#include "sim/scene.hpp"

namespace berth::sim {

/// Radiance (1 = a fully lit white surface) that each pixel collects over its area and the exposure: double[height,
/// width], row-major. Pixels with one edge are integrated exactly, others by a 55-point lattice; see docs/simulator.md.
/// Surfaces later in the list hide earlier ones.
std::vector<double> paint(const Scene& scene, const std::vector<Surface>& surfaces, const RayMap& rays);

/// How far (px) a point at `depth_m` moves over the exposure, at most.
double motion_px(const CameraModel& camera, const Motion& motion, double depth_m);

/// The pose moved to the instant τ (−½ … ½ of the exposure).
Pose moved(const Motion& motion, const Pose& pose, double tau);

}  // namespace berth::sim
