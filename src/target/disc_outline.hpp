#pragma once

#include <array>

#include "berth/types.hpp"

namespace berth {

/// An ellipse: points at d from its centre lie on it where dᵀ M⁻¹ d = 1.
struct Ellipse {
  std::array<double, 2> center = {};
  /// M: xx, xy, yy.
  std::array<double, 3> matrix = {};

  double determinant() const { return matrix[0] * matrix[2] - matrix[1] * matrix[1]; }
  /// Squares of the half axes, the smaller one first.
  std::array<double, 2> axes_squared() const;
};

/// The ellipse with the second moments of the region inside a contour (points as contour_trace writes them, `count` of
/// them, of an outline), in px of the whole image, `scale` times the contour's. The moments are sums of integers:
/// exact, in any order. Returns false where the contour is no ellipse, or one too small or too thin to measure.
bool outline_ellipse(const u32* points, int count, int scale, Ellipse& ellipse);

}  // namespace berth
