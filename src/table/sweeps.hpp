#pragma once

#include <optional>
#include <string>
#include <vector>

#include "berth/marker.hpp"
#include "berth/types.hpp"

namespace berth::table {

/// Where the marker stands when no axis is moved: on the optical axis, facing the camera.
struct Nominal {
  /// Side of the marker's border square, m. 50 px at 1 m through the paper's lens (section 3.5 of the paper).
  double size_m = 0.0745;
  double range_m = 1;
};

/// One place where the table stops for a frame.
struct Stop {
  /// How far the moved axis has come: m or degrees from the nominal place, for z the range; else m along the way, or a
  /// count.
  double travel = 0;
  double size_m = 0;
  /// Marker frame to camera frame.
  Pose truth;
};

/// One experiment.
struct Sweep {
  std::string name;
  /// For people: what the travel is, with its unit.
  std::string travel;
  /// The moved axis: 0 to 5 for x, y, z, rx, ry, rz.
  std::optional<std::size_t> axis;
  std::vector<Stop> stops;
};

/// "x", "y", "z", "rx", "ry", "rz"
const std::vector<std::string>& axis_names();

/// One axis from end to end in even steps, the other five at their nominal place: x ±0.3 m, y ±0.2 m, z from 0.15 to
/// 1.5 m, rx and ry ±60°, rz ±180° about the camera's axes. At least two stops.
Sweep axis_sweep(std::size_t axis, const Nominal& nominal, int stops);

/// Once around the paper's rectangle and back to its start, 60 cm across and 40 cm up at the nominal range (its Figures
/// 13 and 14). At least two stops.
Sweep rectangle_sweep(const Nominal& nominal, int stops);

/// The nominal place again and again: what noise alone does.
Sweep still_sweep(const Nominal& nominal, int stops);

/// The ranges and sides of range_grid, m.
const std::vector<double>& grid_ranges_m();
const std::vector<double>& grid_sizes_m();

/// For each side and in it for each range, `stops` random views: anywhere within 0.05 of the range about the optical
/// axis, tilted by up to 25° about x and y, rolled at will.
std::vector<Sweep> range_grid(int stops, u64 seed);

}  // namespace berth::table
