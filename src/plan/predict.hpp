#pragma once

#include "plan/corner_noise.hpp"
#include "table/pose_error.hpp"

namespace berth::plan {

/// What to expect of a pose.
struct Prediction {
  CornerNoise corners;
  /// As PoseUncertainty's: translation (m), then rotation (rad), camera axes.
  std::array<double, 36> covariance = {};
  /// One standard deviation of each axis; biases count as such.
  table::SixAxes deviation = {};
  /// Of the distance, m: the root of the three positions' squares.
  double position_m = 0;
};

/// The pose's covariance: every independent way the corners may be off (each side shifted, each side turned, all
/// corners outwards) is brought into the corners by one standard deviation, the pose is refined from them as
/// Berth does (refine_pose), and the products of its errors are summed. It knows nothing of the other pose of a plane:
/// of markers below some 20 px and tilts near 0 it says too little. Returns false where the marker is not before the
/// camera.
bool predict(const View& view, Prediction& prediction);

/// Whether nine of ten frames or more of such a view give the marker's code: its modules must be wide enough for their
/// blur, along the shortest side. Light and contrast are taken to suffice.
bool readable(const View& view, const MarkerFamily& family);

/// The marker and a module around it are inside the image.
bool fits(const View& view, const MarkerFamily& family);

/// The furthest at which the view is readable when the marker goes straight away or comes, m from the camera; 0 where
/// it is not even at three times its side.
double decode_range_m(View view, const MarkerFamily& family);

}  // namespace berth::plan
