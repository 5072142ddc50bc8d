#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

#include "berth/marker.hpp"

namespace berth {

/// A dark disc or ring of a target.
struct TargetDisc {
  /// Its centre in the target frame, m.
  double x_m = 0, y_m = 0;
  /// Across its outer edge, m.
  double diameter_m = 0;
  /// Across the light hole of a ring, m; 0 for a disc.
  double hole_m = 0;
};

/// A dark bar with square ends: an arm of a cross. It tells how a target is turned; its place is not measured.
struct TargetBar {
  std::array<double, 2> from_m = {};
  std::array<double, 2> to_m = {};
  double width_m = 0;
};

/// A light plate with dark discs or rings at known places, as on docking ports (docs/disc-targets.md). Target frame: as
/// a marker's, x right and y down as one looks at it, z into the plate; the origin is where the file puts it.
struct DiscTarget {
  /// A pose needs so many discs, and no target has more than the most.
  static constexpr std::size_t kFewestDiscs = 4, kMostDiscs = 16;

  std::string name;
  std::vector<TargetDisc> discs;
  std::vector<TargetBar> bars;
  /// One standard deviation of each coordinate of a centre's place, m: how exactly it was printed or measured. Part of
  /// what a pose is weighed by, and of its covariance.
  double deviation_m = 0;

  /// Throws Error on too few or too many discs, sizes that cannot be, things that stand too near each other, centres on
  /// one line, or a layout that looks the same when it is turned.
  void check() const;
};

/// Reads a target's YAML file (docs/disc-targets.md). Throws Error naming the file, the field, the value and the
/// remedy.
DiscTarget read_disc_target(const std::string& path);

/// Where a frame shows a disc.
struct DiscSight {
  bool seen = false;
  /// The centre of the ellipse that the disc's outline is in an image without distortion, put where the lens has it,
  /// px. It is not where the disc's centre is seen: perspective parts the two, and poses take that into account.
  std::array<double, 2> center_px = {};
  /// Of the centre, px^2: of x, of x with y, of y.
  std::array<double, 3> covariance_px2 = {};
};

/// The pose of a target of discs in one frame.
struct DiscPose {
  /// False where the target was not found; the rest then says nothing.
  bool has_pose = false;
  /// Target frame to camera frame.
  Pose pose;
  /// The error is that of the discs' centres.
  PoseUncertainty uncertainty;
  /// Discs that went into it.
  int used = 0;
  /// Disc by disc of DiscTarget::discs.
  std::array<DiscSight, DiscTarget::kMostDiscs> discs = {};
};

}  // namespace berth
