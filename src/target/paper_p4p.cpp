#include "target/paper_p4p.hpp"

#include <cmath>

#include "pose_algebra.hpp"

namespace berth {
namespace {

Vec3 operator+(const Vec3& a, const Vec3& b) { return {a[0] + b[0], a[1] + b[1], a[2] + b[2]}; }
Vec3 operator-(const Vec3& a, const Vec3& b) { return {a[0] - b[0], a[1] - b[1], a[2] - b[2]}; }
Vec3 operator*(double s, const Vec3& a) { return {s * a[0], s * a[1], s * a[2]}; }

// Shorter than this (image distances at depth 1, cosines) a corner or an edge is no measurement.
constexpr double kDegenerate = 1e-9;

bool normalise(Vec3& a) {
  const double l = length(a);
  if (!(l > kDegenerate)) return false;
  a = (1 / l) * a;
  return true;
}

// Two neighbouring corners of the marker in the camera frame.
struct Edge {
  Vec3 from, to;
};

// Equations (3) and (4): the edge of length `side_m` seen from `from` to `to` (points at depth f = 1). Its parallel on
// the other side of the marker, seen between `across_a` and `across_b`, lies in the plane of those two and the optical
// centre, so the edge is perpendicular to that plane's normal N:
//   (k1 q1 - k0 q0) · N = 0           (3)
//   |k1 q1 - k0 q0| = side             (4)
// The paper names the plane of q0 and q1 itself here; with it (3) holds for every k0, k1, and the parallel edge that it
// introduces for the purpose would go unused.
bool solve_edge(const Vec3& q0, const Vec3& q1, const Vec3& across_a, const Vec3& across_b, double side_m, Edge& edge) {
  Vec3 normal = cross(across_a, across_b);
  if (!normalise(normal)) return false;
  const double n0 = dot(q0, normal), n1 = dot(q1, normal);
  // Both corners lie on one side of that plane, or one would be behind the camera; on it the marker is seen edge-on.
  if (!(n0 * n1 > 0) || !(std::fabs(n0) > kDegenerate && std::fabs(n1) > kDegenerate)) return false;
  const double ratio = n0 / n1;  // k1 / k0
  const double per_k0 = length(ratio * q1 - q0);
  if (!(per_k0 > kDegenerate)) return false;
  const double k0 = side_m / per_k0;
  edge = {k0 * q0, (k0 * ratio) * q1};
  return true;
}

}  // namespace

bool paper_p4p(const CameraModel& camera, double size_m, const std::array<std::array<double, 2>, 4>& corners_px,
               Pose& pose) {
  if (!(size_m > 0) || !finite(size_m)) return false;
  std::array<Vec3, 4> q;
  for (std::size_t i = 0; i < 4; ++i) {
    const std::array<double, 2> p = camera.undistort(corners_px[i][0], corners_px[i][1]);
    if (!finite(p[0]) || !finite(p[1])) return false;
    q[i] = {p[0], p[1], 1};
  }
  // A marker seen from its front has its corners counter-clockwise in the image.
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3 a = q[(i + 1) & 3] - q[i], b = q[(i + 2) & 3] - q[(i + 1) & 3];
    if (!(cross(a, b)[2] < 0)) return false;
  }

  Edge down, right;  // P0P1 // P3P2, and P0P3 // P1P2
  if (!solve_edge(q[0], q[1], q[3], q[2], size_m, down)) return false;
  if (!solve_edge(q[0], q[3], q[1], q[2], size_m, right)) return false;
  Vec3 x_w = down.to - down.from;    // the paper's X axis, from P0 to P1
  Vec3 y_w = right.to - right.from;  // the paper's Y axis, from P0 to P3
  if (!normalise(x_w) || !normalise(y_w)) return false;

  // With noise the two are not quite perpendicular, but their sum and difference always are: turn both by the same.
  Vec3 sum = x_w + y_w, difference = y_w - x_w;
  if (!normalise(sum) || !normalise(difference)) return false;
  const double half = std::sqrt(0.5);
  // Berth's axes: x right (the paper's Y), y down (the paper's X), z into the marker (the paper's -Z, equation 5).
  const Vec3 x = half * (sum + difference);
  const Vec3 y = half * (sum - difference);
  const Vec3 z = cross(x, y);
  const Vec3 t = down.from + (size_m / 2) * (x + y);  // from the paper's origin P0 to the centre
  if (!(t[2] > 0) || !finite(t[0]) || !finite(t[1]) || !finite(t[2])) return false;
  pose.R = {x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]};
  pose.t = t;
  return true;
}

}  // namespace berth
