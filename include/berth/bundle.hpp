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

/// "tag36h11 7"
std::string name_of(const BundleMarker& marker);

/// Markers that do not move against each other: on a board, nested in each other, or around a dock. One pose for all.
struct Bundle {
  std::string name;
  std::vector<BundleMarker> markers;
  /// One standard deviation of each coordinate of a corner's place in the bundle, m: how exactly it was printed or
  /// surveyed. Part of what a pose is weighed by, and of its covariance.
  double deviation_m = 0;

  /// The marker's place; null where it is not of this bundle.
  const BundleMarker* find(const MarkerFamily& family, int id) const;
  /// Throws Error on a bundle without markers, a size that is not above 0, an id that the family does not have, a
  /// marker named twice, a matrix that is not a rotation or a deviation below 0.
  void check() const;
};

/// The bundles of a file: apriltag_ros' YAML with `tag_bundles`, or a WPILib field layout in JSON, told apart by what
/// is in it. The bundle frame is the file's own; the markers' frames are turned into Berth's (docs/bundles.md).
/// `size_m` and `family_name` are what a field layout does not say: its markers' side (0: not known, an Error where it
/// is needed) and family; the family holds too where the YAML says nothing. Throws Error naming the file, the field,
/// the value and the remedy.
std::vector<Bundle> read_bundles(const std::string& path, double size_m = 0,
                                 const std::string& family_name = "tag36h11");

/// Writes a file of one bundle in apriltag_ros' YAML. Places come back as the same doubles, rotations to within 3e-15,
/// and what was read from such a file is written with the same bytes. Throws Error where the bundle does not hold
/// (Bundle::check) or the file cannot be written.
void write_bundle(const std::string& path, const Bundle& bundle);

/// The pose of a bundle, from those of its markers that were read.
struct BundlePose {
  /// False where too little was read; the rest then says nothing, except how many were kept out.
  bool has_pose = false;
  /// Bundle frame to camera frame.
  Pose pose;
  /// Its covariance is about the bundle's origin; the corners' error is that of the corners that went into it.
  PoseUncertainty uncertainty;
  /// Markers that went into it, and those that were read but do not fit their place.
  int used = 0, kept_out = 0;
  /// Single corners that do not fit, of markers whose other corners went into it.
  int corners_kept_out = 0;
};

}  // namespace berth
