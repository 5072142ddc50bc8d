#include "target/quad_map.hpp"

namespace berth {
namespace {

// Smallest depth, relative to the first corner's, that a point may have: the horizon is at 0.
constexpr double kMinDepth = 0.05;

}  // namespace

bool QuadMap::set(const Corners& q, double side, double reach) {
  for (std::size_t i = 0; i < 4; ++i) {
    const auto& a = q[i];
    const auto& b = q[(i + 1) & 3];
    const auto& c = q[(i + 2) & 3];
    const double turn = (b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]);
    if (!(turn > 0)) return false;
  }
  const double dx1 = q[1][0] - q[2][0], dx2 = q[3][0] - q[2][0];
  const double dy1 = q[1][1] - q[2][1], dy2 = q[3][1] - q[2][1];
  const double sx = q[0][0] - q[1][0] + q[2][0] - q[3][0];
  const double sy = q[0][1] - q[1][1] + q[2][1] - q[3][1];
  const double det = dx1 * dy2 - dx2 * dy1;
  if (!(det > 0 || det < 0)) return false;
  const double scale = 1 / side;
  const double g = (sx * dy2 - dx2 * sy) / det;
  const double h = (dx1 * sy - sx * dy1) / det;
  ax = (q[1][0] - q[0][0] + g * q[1][0]) * scale;
  bx = (q[3][0] - q[0][0] + h * q[3][0]) * scale;
  cx = q[0][0];
  ay = (q[1][1] - q[0][1] + g * q[1][1]) * scale;
  by = (q[3][1] - q[0][1] + h * q[3][1]) * scale;
  cy = q[0][1];
  gz = g * scale;
  hz = h * scale;
  // The depth is linear in (u, v), so its least value over the square with its margin is at one of the corners.
  for (const double u : {-reach, side + reach}) {
    for (const double v : {-reach, side + reach}) {
      if (!(gz * u + hz * v + 1 > kMinDepth)) return false;
    }
  }
  return true;
}

}  // namespace berth
