#pragma once

#include <array>

#include "target/lens_blocks.hpp"
#include "target/quad_map.hpp"

namespace berth {

/// Where the image shows which place of a marker, the lens included. Marker coordinates (u, v) are modules from the
/// border's upper left, image points px.
class MarkerMap {
 public:
  /// Corners clockwise from the upper left. Returns false unless they are those of a square `border` modules wide seen
  /// from in front, and the map stays finite up to `reach` modules outside.
  bool set(const LensBlocks& lens, const Corners& corners, double border, double reach);

  /// From the lens' plane: rows of u z, v z and z.
  const std::array<std::array<double, 3>, 3>& back() const { return back_; }
  /// Image point of (u, v), and its derivative: dx/du, dx/dv, dy/du, dy/dv.
  std::array<double, 2> at(double u, double v, std::array<double, 4>& derivative) const;

 private:
  const LensBlocks* lens_ = nullptr;
  QuadMap rays_;  // from (u, v) to the lens' plane
  std::array<std::array<double, 3>, 3> back_ = {};
};

}  // namespace berth
