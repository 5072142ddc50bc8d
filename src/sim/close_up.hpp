#pragma once

#include "sim/scene.hpp"

namespace berth::sim {

/// A frame for measuring corners: one marker of tag36h11, tilted and turned at random, at a random place of a camera's
/// image, in even light; the frame is cut out about it (the camera's principal point moves, the lens stays).
struct CloseUp {
  /// Side as it would be seen frontally, and the noise's standard deviation, px and grey levels.
  double side_px = 80;
  double noise = 2;
  double most_tilt_deg = 35;
  /// At the image's border, where the lens bends most, instead of anywhere.
  bool at_border = false;
};

/// Scene `index` of such frames; what the sensor does beyond noise is for the caller to change. Blur sigma 0.6 px.
Scene close_up_scene(const CameraModel& camera, const CloseUp& what, int index);

}  // namespace berth::sim
