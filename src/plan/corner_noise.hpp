#pragma once

#include <array>

#include "berth/camera.hpp"
#include "berth/marker.hpp"
#include "sim/scene.hpp"

namespace berth::plan {

/// A marker before a camera.
struct View {
  CameraModel camera = paper_camera();
  /// white_level is that of a fully lit white surface at the exposure in question.
  sim::Sensor sensor;
  /// Side of the marker's border square, m, and where it is.
  double size_m = 0.1;
  Pose pose;
  /// Radiance of a white surface where the marker is; 1: fully lit.
  double light = 1;
  /// How far the marker's image moves during the exposure, px.
  double motion_px = 0;
};

/// Where the corners truly are, px. Paper's order.
std::array<std::array<double, 2>, 4> true_corners(const View& view);

/// How well the corners of a view are found; of one standard deviation where nothing else is said.
struct CornerNoise {
  /// Mean and shortest side, px.
  double side_px = 0, shortest_px = 0;
  /// Between the print's black and white, and of a pixel on the edge between them, grey levels.
  double contrast = 0, noise = 0;
  /// Blur of an edge: lens, defocus, motion and the pixel's own square, px.
  double blur_px = 0;
  /// Of side k (from corner k to the next) at its ends, across it, px; and what share of that variance moves the whole
  /// side, while the rest turns it about its middle.
  std::array<double, 4> side_end_px = {}, shift_share = {};
  /// All of it in a corner's coordinate, px: as DetectorConfig::corner_deviation_px, where that is not to be measured.
  double corner_px = 0;
};

/// The model of docs/plan.md: straight lines through the places where rows cross a blurred edge of a print of albedo
/// 0.88 and 0.05, by the bound of Cramér and Rao, times what Berth's refinement of sides was measured to need more; and
/// what that leaves without noise.
CornerNoise corner_noise(const View& view);

}  // namespace berth::plan
