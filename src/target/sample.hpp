#pragma once

#include <algorithm>

#include "berth/image.hpp"

namespace berth {

/// Grey level at a point (px, pixel centres at integers) by bilinear interpolation. Returns false outside the image.
inline bool sample(View2D<const u8> image, double x, double y, double& value) {
  if (!(x > -0.5 && y > -0.5 && x < image.width - 0.5 && y < image.height - 0.5)) return false;
  // The half pixel outside the outermost centres takes their value.
  x = std::min(std::max(x, 0.0), static_cast<double>(image.width - 1));
  y = std::min(std::max(y, 0.0), static_cast<double>(image.height - 1));
  const int ix = std::min(static_cast<int>(x), std::max(image.width - 2, 0));
  const int iy = std::min(static_cast<int>(y), std::max(image.height - 2, 0));
  const double fx = x - ix;
  const double fy = y - iy;
  const int right = image.width > 1 ? 1 : 0;
  const u8* const above = image.row(iy) + ix;
  const u8* const below = image.height > 1 ? above + image.stride : above;
  const double top = above[0] + (above[right] - above[0]) * fx;
  const double bottom = below[0] + (below[right] - below[0]) * fx;
  value = top + (bottom - top) * fy;
  return true;
}

}  // namespace berth
