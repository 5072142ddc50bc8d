#include "sim/printed_marker.hpp"

#include <algorithm>
#include <string>

#include "berth/error.hpp"

namespace berth::sim {
std::array<Vec3, 4> marker_corners(double size_m) {
  const double h = size_m / 2;
  return {Vec3{-h, -h, 0}, Vec3{-h, h, 0}, Vec3{h, h, 0}, Vec3{h, -h, 0}};
}

double needed_modules(const MarkerFamily& family) { return std::max(family.total_width, family.border_width + 2); }

std::vector<double> pattern_cells(const MarkerFamily& family, u64 code, double white, double black) {
  const int side = family.total_width + 2;
  const int offset = (side - family.border_width) / 2;
  std::vector<double> cells(static_cast<std::size_t>(side) * static_cast<std::size_t>(side), white);
  const auto cell = [&](int column, int row) -> double& {
    return cells[static_cast<std::size_t>(row + offset) * static_cast<std::size_t>(side) +
                 static_cast<std::size_t>(column + offset)];
  };
  // The dark ring: the border's own outermost modules, or those just outside of a border that is light inside.
  const int first = family.reversed_border ? -1 : 0;
  const int last = family.border_width - 1 - first;
  for (int i = first; i <= last; ++i) cell(i, first) = cell(i, last) = cell(first, i) = cell(last, i) = black;
  const std::size_t bits = family.bit_x.size();
  for (std::size_t i = 0; i < bits; ++i) {
    cell(family.bit_x[i], family.bit_y[i]) = ((code >> (bits - 1 - i)) & 1) != 0 ? white : black;
  }
  return cells;
}

std::vector<Vec2> rectangle(double width_m, double height_m) {
  const double w = width_m / 2, h = height_m / 2;
  return {{-w, -h}, {w, -h}, {w, h}, {-w, h}};
}

Surface pattern_surface(const MarkerFamily& family, u64 code, double size_m, const Pose& pose, double margin_modules,
                        double white, double black) {
  const double module = size_m / family.border_width;
  const int side = family.total_width + 2;
  Surface surface;
  surface.pose = pose;
  surface.columns = surface.rows = side;
  surface.cell_width = surface.cell_height = module;
  surface.left = surface.top = -0.5 * side * module;
  surface.cells = pattern_cells(family, code, white, black);
  const double width = (family.total_width + 2 * margin_modules) * module;
  surface.outline = rectangle(width, width);
  surface.fine = true;
  return surface;
}

std::vector<Surface> marker_surfaces(const SceneMarker& marker) {
  const MarkerFamily& shape = berth::family(marker.family);
  if (marker.id < 0 || static_cast<std::size_t>(marker.id) >= shape.codes.size()) {
    throw Error("simulator: " + marker.family + " has no id " + std::to_string(marker.id) + ": use 0 to " +
                std::to_string(shape.codes.size() - 1));
  }
  const Surface pattern = pattern_surface(shape, shape.codes[static_cast<std::size_t>(marker.id)], marker.size_m,
                                          marker.pose, marker.margin_modules, marker.white, marker.black);
  std::vector<Surface> surfaces;
  if (marker.plate_m > 0) {
    Surface plate;
    plate.pose = marker.pose;
    const double width = 2 * pattern.outline[2][0] + 2 * marker.plate_m;
    plate.outline = rectangle(width, width);
    plate.cells = {marker.plate_albedo};
    surfaces.push_back(plate);
  }
  surfaces.push_back(pattern);
  return surfaces;
}

}  // namespace berth::sim
