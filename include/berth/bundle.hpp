#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "berth/camera.hpp"
#include "berth/marker.hpp"

namespace berth {

/// A marker's place in a bundle.
struct BundleMarker {
  const MarkerFamily* family = nullptr;
  int id = 0;
  /// Side that its corners span, m.
  double size_m = 0;
  /// Marker frame to bundle frame: a marker's point X is at R·X + t (m).
  Pose pose;
};

/// Markers that do not move against each other: on a board, nested in each other, or around a dock. One pose for all.
struct Bundle {
  std::string name;
  std::vector<BundleMarker> markers;

  /// The marker's place; null where it is not of this bundle.
  const BundleMarker* find(const MarkerFamily& family, int id) const;
  /// Throws Error on a bundle without markers, a size that is not above 0, an id that the family does not have, a
  /// marker named twice or a matrix that is not a rotation.
  void check() const;
};

/// The pose of a bundle, from those of its markers that were read.
struct BundlePose {
  /// Bundle frame to camera frame.
  Pose pose;
  PoseUncertainty uncertainty;
  /// Markers that went into it, and those that were read but do not fit their place.
  int used = 0, kept_out = 0;
};

}  // namespace berth
