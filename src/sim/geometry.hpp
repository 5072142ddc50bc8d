#pragma once

#include "exact_math.hpp"
#include "pose_algebra.hpp"

namespace berth::sim {

using berth::add;
using berth::column;
using berth::compose;
using berth::cross;
using berth::dot;
using berth::exact_cos;
using berth::exact_exp;
using berth::exact_log;
using berth::exact_sin;
using berth::inverse;
using berth::kPi;
using berth::length;
using berth::Mat3;
using berth::normalized;
using berth::product;
using berth::radians;
using berth::scaled;
using berth::small_rotation;
using berth::transform;
using berth::translation;
using berth::transposed;
using berth::Vec2;
using berth::Vec3;

inline Mat3 rotation_x(double angle_rad) {
  const double c = exact_cos(angle_rad), s = exact_sin(angle_rad);
  return {1, 0, 0, 0, c, -s, 0, s, c};
}
inline Mat3 rotation_y(double angle_rad) {
  const double c = exact_cos(angle_rad), s = exact_sin(angle_rad);
  return {c, 0, s, 0, 1, 0, -s, 0, c};
}
inline Mat3 rotation_z(double angle_rad) {
  const double c = exact_cos(angle_rad), s = exact_sin(angle_rad);
  return {c, -s, 0, s, c, 0, 0, 0, 1};
}
/// Rz · Ry · Rx: about the fixed x, then y, then z axis.
inline Mat3 rotation(double rx_rad, double ry_rad, double rz_rad) {
  return product(rotation_z(rz_rad), product(rotation_y(ry_rad), rotation_x(rx_rad)));
}

}  // namespace berth::sim
