#pragma once

#include <array>

#include "berth/image.hpp"
#include "berth/marker.hpp"

namespace berth {

/// How well the device's line through a side fits what it is made of.
struct SideFit {
  /// Rows or columns that saw the edge.
  int stations = 0;
  /// Mean distance of their edges from the line, along the row or column, px.
  double residual_px = 0;
};

/// Standard deviation of each side's blur with the pixel's own square, px, from the steepness of the edge and the
/// levels half a module to either side. Where modules are not much wider than it, it comes out too small.
/// `corners_px`: side k is from corner k to the next; `border_width`: modules of a side.
std::array<double, 4> side_blurs(View2D<const u8> image, const std::array<std::array<double, 2>, 4>& corners_px,
                                 int border_width);

/// How far each corner moves when all sides move outwards by one px. `corners_px` in the paper's order.
std::array<std::array<double, 2>, 4> outwards(const std::array<std::array<double, 2>, 4>& corners_px);

/// Covariance of the corners where refined sides meet (docs/corners.md): of sides as above, by how their lines fit and
/// by their blurs.
CornerCovariance side_covariance(const std::array<std::array<double, 2>, 4>& corners_px, int border_width,
                                 const std::array<SideFit, 4>& fits, const std::array<double, 4>& blurs_px);

}  // namespace berth
