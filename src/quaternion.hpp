#pragma once

#include "pose_algebra.hpp"

/// Quaternions and rotations, by + - x / and square roots in a fixed order: the same bits everywhere.
namespace berth {

/// w, x, y, z
using Quaternion = std::array<double, 4>;

/// Its rotation; of any length but 0.
inline Mat3 rotation_of(const Quaternion& q) {
  const double s = 2 / (q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
  const double xx = s * q[1] * q[1], yy = s * q[2] * q[2], zz = s * q[3] * q[3];
  const double xy = s * q[1] * q[2], xz = s * q[1] * q[3], yz = s * q[2] * q[3];
  const double wx = s * q[0] * q[1], wy = s * q[0] * q[2], wz = s * q[0] * q[3];
  return {1 - (yy + zz), xy - wz,       xz + wy,  //
          xy + wz,       1 - (xx + zz), yz - wx,  //
          xz - wy,       yz + wx,       1 - (xx + yy)};
}

/// From the largest of the four, which is more than 1/2 (Shepperd), with w or else the first that is not 0 above 0.
inline Quaternion quaternion_of(const Mat3& r) {
  const double trace = r[0] + r[4] + r[8];
  const std::array<double, 4> four = {1 + trace, 1 + 2 * r[0] - trace, 1 + 2 * r[4] - trace, 1 + 2 * r[8] - trace};
  std::size_t k = 0;
  for (std::size_t i = 1; i < 4; ++i) k = four[i] > four[k] ? i : k;
  const double big = std::sqrt(four[k]) / 2, f = 0.25 / big;
  const double x = f * (r[7] - r[5]), y = f * (r[2] - r[6]), z = f * (r[3] - r[1]);
  const double xy = f * (r[1] + r[3]), xz = f * (r[2] + r[6]), yz = f * (r[5] + r[7]);
  Quaternion q = k == 0   ? Quaternion{big, x, y, z}
                 : k == 1 ? Quaternion{x, big, xy, xz}
                 : k == 2 ? Quaternion{y, xy, big, yz}
                          : Quaternion{z, xz, yz, big};
  std::size_t first = 0;
  while (q[first] == 0) ++first;
  const double sign = q[first] < 0 ? -1 : 1;
  for (double& value : q) value = value * sign + 0.0;  // no -0
  return q;
}

}  // namespace berth
