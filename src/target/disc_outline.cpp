#include "target/disc_outline.hpp"

#include <algorithm>
#include <cmath>
#include <cstdint>

namespace berth {
namespace {

// Half axes, px of the contour: below the first a disc is a handful of pixels; a circle tilted by 75° has the second.
constexpr double kLeastHalfAxis = 2.2, kLeastShare = 0.25;
// How far the outline of pixels may lie off the ellipse: the pixels' own steps, px, and a share of the shorter half
// axis. Of a square the corners lie off by 0.22 of it and more.
constexpr double kSteps = 1.2, kOff = 0.05;

/// Sums over the pixels of a region, about the first point of its outline.
struct Moments {
  std::int64_t area = 0, x = 0, y = 0, xx = 0, xy = 0, yy = 0;
};

struct Crack {
  std::int64_t x, y;  // between pixels x - 1 and x of row y
  bool is_end;        // the region lies to its left
};

Crack crack_at(u32 point) {
  const u32 half_y = point >> 16;
  return {static_cast<std::int64_t>((point & 0xffffu) / 2), static_cast<std::int64_t>(half_y / 2), half_y % 2 == 1};
}

/// What a row's pixels left of an end add up to, less those left of its start. Bounds: |x|, |y| < 2^14, fewer than 2^16
/// points: each sum stays below 2^60.
Moments moments_of(const u32* points, int count, const Crack& origin) {
  Moments sum;
  for (int i = 0; i < count; ++i) {
    const Crack crack = crack_at(points[i]);
    const std::int64_t x = crack.x - origin.x, y = crack.y - origin.y, sign = crack.is_end ? 1 : -1;
    const std::int64_t line = x * (x - 1) / 2;
    sum.area += sign * x;
    sum.x += sign * line;
    sum.y += sign * x * y;
    sum.xx += sign * (x * (x - 1) * (2 * x - 1) / 6);
    sum.xy += sign * line * y;
    sum.yy += sign * x * y * y;
  }
  return sum;
}

/// Whether every crack lies near the ellipse (px of the contour).
bool is_round(const u32* points, int count, const Ellipse& e) {
  const double det = e.determinant();
  const double a = e.matrix[2] / det, b = -e.matrix[1] / det, d = e.matrix[0] / det;
  const double limit = kSteps + kOff * std::sqrt(e.axes_squared()[0]);
  for (int i = 0; i < count; ++i) {
    const Crack crack = crack_at(points[i]);
    const double x = static_cast<double>(crack.x) - 0.5 - e.center[0], y = static_cast<double>(crack.y) - e.center[1];
    const double gx = a * x + b * y, gy = b * x + d * y;
    const double q = x * gx + y * gy;
    // To first order the distance is (q - sqrt q) / |gradient|.
    const double off = q - std::sqrt(q);
    if (!(off * off <= limit * limit * (gx * gx + gy * gy))) return false;
  }
  return true;
}

}  // namespace

std::array<double, 2> Ellipse::axes_squared() const {
  const double half = (matrix[0] + matrix[2]) / 2, difference = (matrix[0] - matrix[2]) / 2;
  const double root = std::sqrt(difference * difference + matrix[1] * matrix[1]);
  return {half - root, half + root};
}

bool outline_ellipse(const u32* points, int count, int scale, Ellipse& ellipse) {
  if (count < 8) return false;
  const Crack origin = crack_at(points[0]);
  const Moments sum = moments_of(points, count, origin);
  if (sum.area <= 0) return false;
  const auto area = static_cast<double>(sum.area);
  const double mx = static_cast<double>(sum.x) / area, my = static_cast<double>(sum.y) / area;
  // A disc's second moment is a quarter of its radius squared; a pixel's own is 1/12.
  Ellipse found;
  found.center = {mx + static_cast<double>(origin.x), my + static_cast<double>(origin.y)};
  found.matrix = {4 * (static_cast<double>(sum.xx) / area - mx * mx + 1.0 / 12),
                  4 * (static_cast<double>(sum.xy) / area - mx * my),
                  4 * (static_cast<double>(sum.yy) / area - my * my + 1.0 / 12)};
  const std::array<double, 2> axes = found.axes_squared();
  if (!(axes[0] >= kLeastHalfAxis * kLeastHalfAxis && axes[0] >= kLeastShare * kLeastShare * axes[1])) return false;
  if (!is_round(points, count, found)) return false;
  // Pixel centres lie at integers in both images.
  for (double& value : found.center) value = (value + 0.5) * scale - 0.5;
  for (double& value : found.matrix) value *= scale * scale;
  ellipse = found;
  return true;
}

}  // namespace berth
