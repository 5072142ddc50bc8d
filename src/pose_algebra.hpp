#pragma once

#include <array>
#include <cmath>

#include "berth/camera.hpp"
#include "berth/marker.hpp"

/// Vectors, rotations and poses in doubles, by + - x / and square roots in a fixed order: the same bits everywhere.
namespace berth {

using Vec2 = std::array<double, 2>;
using Vec3 = std::array<double, 3>;
/// Row-major 3 × 3.
using Mat3 = std::array<double, 9>;

inline double dot(const Vec3& a, const Vec3& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
inline Vec3 cross(const Vec3& a, const Vec3& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
inline Vec3 add(const Vec3& a, const Vec3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
inline Vec3 scaled(const Vec3& a, double s) { return {a[0] * s, a[1] * s, a[2] * s}; }
inline double length(const Vec3& a) { return std::sqrt(dot(a, a)); }
inline Vec3 normalized(const Vec3& a) { return scaled(a, 1 / length(a)); }

inline Mat3 product(const Mat3& a, const Mat3& b) {
  Mat3 c{};
  for (int i = 0; i < 3; ++i) {
    for (int j = 0; j < 3; ++j) c[3 * i + j] = a[3 * i] * b[j] + a[3 * i + 1] * b[3 + j] + a[3 * i + 2] * b[6 + j];
  }
  return c;
}
inline Vec3 product(const Mat3& m, const Vec3& v) {
  return {m[0] * v[0] + m[1] * v[1] + m[2] * v[2], m[3] * v[0] + m[4] * v[1] + m[5] * v[2],
          m[6] * v[0] + m[7] * v[1] + m[8] * v[2]};
}
inline Mat3 transposed(const Mat3& m) { return {m[0], m[3], m[6], m[1], m[4], m[7], m[2], m[5], m[8]}; }
inline Vec3 column(const Mat3& m, int j) { return {m[j], m[3 + j], m[6 + j]}; }

/// The point in the outer frame.
inline Vec3 transform(const Pose& pose, const Vec3& point) { return add(product(pose.R, point), pose.t); }
/// `inner` seen from `outer`'s outer frame.
inline Pose compose(const Pose& outer, const Pose& inner) {
  Pose pose;
  pose.R = product(outer.R, inner.R);
  pose.t = transform(outer, inner.t);
  return pose;
}
inline Pose inverse(const Pose& pose) {
  Pose result;
  result.R = transposed(pose.R);
  result.t = scaled(product(result.R, pose.t), -1);
  return result;
}
inline Pose translation(double x, double y, double z) {
  Pose pose;
  pose.t = {x, y, z};
  return pose;
}

/// Rotation about `w` by 2 atan(|w| / 2) (Cayley's form): by |w| to within |w|^3 / 12, and exactly orthogonal.
inline Mat3 small_rotation(const Vec3& w) {
  const Vec3 h = scaled(w, 0.5);
  const double n = dot(h, h);
  const double k = 2 / (1 + n);
  return {1 + k * (h[0] * h[0] - n), k * (h[0] * h[1] - h[2]),  k * (h[0] * h[2] + h[1]),
          k * (h[0] * h[1] + h[2]),  1 + k * (h[1] * h[1] - n), k * (h[1] * h[2] - h[0]),
          k * (h[0] * h[2] - h[1]),  k * (h[1] * h[2] + h[0]),  1 + k * (h[2] * h[2] - n)};
}

/// The w of small_rotation(w), for turns of less than half a circle.
inline Vec3 turn_of(const Mat3& r) {
  const double k = 2 / (1 + r[0] + r[4] + r[8]);
  return {k * (r[7] - r[5]), k * (r[2] - r[6]), k * (r[3] - r[1])};
}

/// What takes `from` to `to`: translation, and the turn w of small_rotation(w) · from.R.
inline std::array<double, 6> step_between(const Pose& from, const Pose& to) {
  const Vec3 w = turn_of(product(to.R, transposed(from.R)));
  return {to.t[0] - from.t[0], to.t[1] - from.t[1], to.t[2] - from.t[2], w[0], w[1], w[2]};
}

/// The inverse of step_between: `step` added to a pose.
inline Pose moved(const Pose& pose, const std::array<double, 6>& step) {
  return {product(small_rotation({step[3], step[4], step[5]}), pose.R),
          {pose.t[0] + step[0], pose.t[1] + step[1], pose.t[2] + step[2]}};
}

/// Row-major 6 × 6: how step_between(from, moved(to, step)) changes with a small step, where `off` is
/// step_between(from, to). Turns compose as Gibbs vectors, h' = (a + h + a × h) / (1 - a·h), a and h halves of the
/// turns: from a = 0 the derivative is 1 - [h]x + h hᵀ.
inline std::array<double, 36> by_small_step(const std::array<double, 6>& off) {
  const double x = off[3] / 2, y = off[4] / 2, z = off[5] / 2;
  return {1, 0, 0, 0,         0,         0,          //
          0, 1, 0, 0,         0,         0,          //
          0, 0, 1, 0,         0,         0,          //
          0, 0, 0, 1 + x * x, x * y + z, x * z - y,  //
          0, 0, 0, x * y - z, 1 + y * y, y * z + x,  //
          0, 0, 0, x * z + y, y * z - x, 1 + z * z};
}

/// A marker's corners in its own frame, m, in the paper's order: upper left, lower left, lower right, upper right.
inline std::array<Vec3, 4> corner_places(double size_m) {
  const double h = size_m / 2;
  return {Vec3{-h, -h, 0}, Vec3{-h, h, 0}, Vec3{h, h, 0}, Vec3{h, -h, 0}};
}
/// Image (px) of a point before the camera, in its frame.
inline Vec2 image_of(const CameraModel& camera, const Vec3& point) {
  return camera.project(point[0] / point[2], point[1] / point[2]);
}

/// No infinity and no NaN.
inline bool finite(double v) { return v - v == 0; }

/// Inverse; the determinant must not be zero.
inline Mat3 inverse(const Mat3& m) {
  const Vec3 a = {m[0], m[3], m[6]}, b = {m[1], m[4], m[7]}, c = {m[2], m[5], m[8]};
  const Vec3 bc = cross(b, c), ca = cross(c, a), ab = cross(a, b);
  const double d = dot(a, bc);
  return {bc[0] / d, bc[1] / d, bc[2] / d, ca[0] / d, ca[1] / d, ca[2] / d, ab[0] / d, ab[1] / d, ab[2] / d};
}

}  // namespace berth
