#pragma once

#include <array>

namespace berth {

using Corners = std::array<std::array<double, 2>, 4>;

/// The projective map of a square of `side` units onto a quadrilateral: (0,0), (side,0), (side,side), (0,side) go to
/// the four corners in order. Closed form (Heckbert 1989), + − × ÷ only.
struct QuadMap {
  double ax = 0, bx = 0, cx = 0, ay = 0, by = 0, cy = 0, gz = 0, hz = 0;

  /// Returns false unless the corners are convex, run clockwise on the screen and the map stays finite up to `reach`
  /// units outside the square.
  bool set(const Corners& q, double side, double reach);

  /// Image point of the square's point (u, v).
  void at(double u, double v, double& x, double& y) const {
    const double z = 1 / (gz * u + hz * v + 1);
    x = (ax * u + bx * v + cx) * z;
    y = (ay * u + by * v + cy) * z;
  }
};

}  // namespace berth
