#pragma once

#include <array>
#include <vector>

#include "berth/marker.hpp"
#include "sim/scene.hpp"

namespace berth::sim {

// The simulator's own idea of a printed marker and of the marker frame, apart from the engine's for honest tests.

/// Corners of the border square in the marker frame (docs/coordinate-frames.md: origin in the middle, x right, y down,
/// z into the plate: that of a Surface), paper's order: upper left, lower left, lower right, upper right of the upright
/// marker.
std::array<Vec3, 4> marker_corners(double size_m);

/// Width of the pattern with one light module around the border, in modules: what a decoder needs to see.
double needed_modules(const MarkerFamily& family);

/// A code word as albedos, row-major [total_width + 2, total_width + 2]: the pattern and one more ring of light
/// modules. Modules that carry nothing (the corners of round families) are light: such markers are printed on white.
std::vector<double> pattern_cells(const MarkerFamily& family, u64 code, double white, double black);

/// The pattern of a code word as a surface.
Surface pattern_surface(const MarkerFamily& family, u64 code, double size_m, const Pose& pose, double margin_modules,
                        double white, double black);

/// The plate (where there is one) and the pattern, far to near. Throws Error on an unknown family or id.
std::vector<Surface> marker_surfaces(const SceneMarker& marker);

/// A rectangle centred in its plane.
std::vector<Vec2> rectangle(double width_m, double height_m);

}  // namespace berth::sim
