#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "berth/marker.hpp"

namespace berth::cli {

/// The way of one marker in the camera frame.
struct Trajectory {
  std::string title;
  double size_m = 0;
  struct Point {
    std::optional<Pose> truth, estimate;
  };
  std::vector<Point> points;
};

/// The drawing as SVG text: seen from above (x, z), from the side (z, y) and from the camera (x, y) in metres, equal
/// scales within a view, the estimate over the truth, the marker's square where it was last, corner 1 dotted; and the
/// position error over the range where there is truth.
std::string trajectory_svg(const Trajectory& trajectory);

/// Corner i (paper's order: upper left, lower left, lower right, upper right) in the marker frame, m.
std::array<double, 3> marker_corner(int i, double size_m);

}  // namespace berth::cli
