#include "target/planar_pose.hpp"

#include <algorithm>
#include <cmath>

#include "pose_algebra.hpp"

namespace berth {
namespace {

using Corners = std::array<Vec2, 4>;

constexpr double kDegenerate = 1e-12;

// Image at depth 1 of the marker's plane (x, y, 1), metres from its centre: Heckbert's square to quadrilateral, of the
// square with corners (0,0), (0,1), (1,1), (1,0) of (right, down), then moved and scaled.
bool homography(const Corners& p, double size_m, Mat3& h) {
  const Vec2 &ul = p[0], &ll = p[1], &lr = p[2], &ur = p[3];
  const double ax = ur[0] - lr[0], ay = ur[1] - lr[1], bx = ll[0] - lr[0], by = ll[1] - lr[1];
  const double sx = ul[0] - ur[0] + lr[0] - ll[0], sy = ul[1] - ur[1] + lr[1] - ll[1];
  const double det = ax * by - bx * ay;
  if (!(std::fabs(det) > kDegenerate)) return false;
  const double g = (sx * by - bx * sy) / det, k = (ax * sy - sx * ay) / det;
  const Mat3 unit = {ur[0] - ul[0] + g * ur[0],
                     ll[0] - ul[0] + k * ll[0],
                     ul[0],
                     ur[1] - ul[1] + g * ur[1],
                     ll[1] - ul[1] + k * ll[1],
                     ul[1],
                     g,
                     k,
                     1};
  h = product(unit, Mat3{1 / size_m, 0, 0.5, 0, 1 / size_m, 0.5, 0, 0, 1});
  const double scale = h[8];
  if (!(std::fabs(scale) > kDegenerate)) return false;
  for (double& value : h) value /= scale;
  return true;
}

// A rotation that takes the optical axis to the direction of (p, q, 1).
Mat3 towards(double p, double q) {
  const double s = std::sqrt(p * p + q * q + 1);
  const double f = 1 / (s * (s + 1));  // (1 - cos) / sin^2 · 1 / s^2
  return {1 - p * p * f, -p * q * f, p / s, -p * q * f, 1 - q * q * f, q / s, -p / s, -q / s, 1 / s};
}

// The best translation for a rotation: linear least squares of u (z + t_z) = x + t_x and the same in v.
bool translation_for(const Mat3& R, const Vec3* places, const Vec2* seen, std::size_t count, Vec3& t) {
  const auto n = static_cast<double>(count);
  double su = 0, sv = 0, square = 0, rx = 0, ry = 0, rz = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Vec3 at = product(R, places[i]);
    const double u = seen[i][0], v = seen[i][1];
    const double eu = u * at[2] - at[0], ev = v * at[2] - at[1];
    su += u;
    sv += v;
    square += u * u + v * v;
    rx += eu;
    ry += ev;
    rz -= u * eu + v * ev;
  }
  // n 0 -su | 0 n -sv | -su -sv square
  const double det = square - (su * su + sv * sv) / n;
  if (!(det > kDegenerate)) return false;
  t[2] = (rz + (su * rx + sv * ry) / n) / det;
  t[0] = (rx + su * t[2]) / n;
  t[1] = (ry + sv * t[2]) / n;
  return t[2] > 0;
}

}  // namespace

int planar_poses(const CameraModel& camera, double size_m, const std::array<std::array<double, 2>, 4>& corners_px,
                 std::array<Pose, 2>& poses) {
  if (!(size_m > 0) || !finite(size_m)) return 0;
  Corners seen;
  for (std::size_t i = 0; i < 4; ++i) {
    seen[i] = camera.undistort(corners_px[i][0], corners_px[i][1]);
    if (!finite(seen[i][0]) || !finite(seen[i][1])) return 0;
  }
  // A marker seen from its front has its corners counter-clockwise in the image.
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec2 &a = seen[i], &b = seen[(i + 1) & 3], &c = seen[(i + 2) & 3];
    if (!((b[0] - a[0]) * (c[1] - b[1]) - (b[1] - a[1]) * (c[0] - b[0]) < 0)) return 0;
  }
  Mat3 h;
  if (!homography(seen, size_m, h)) return 0;

  // Derivative of the homography in the marker's middle, which is seen at (p, q).
  const double p = h[2], q = h[5];
  const std::array<Vec3, 4> places = corner_places(size_m);
  return planar_poses({p, q}, {h[0] - h[6] * p, h[1] - h[7] * p, h[3] - h[6] * q, h[4] - h[7] * q}, places.data(),
                      seen.data(), places.size(), poses);
}

int planar_poses(const std::array<double, 2>& origin, const std::array<double, 4>& derivative,
                 const std::array<double, 3>* places_m, const std::array<double, 2>* seen, std::size_t count,
                 std::array<Pose, 2>& poses) {
  const double p = origin[0], q = origin[1];
  const double j00 = derivative[0], j01 = derivative[1], j10 = derivative[2], j11 = derivative[3];
  const Mat3 turn = towards(p, q);
  // [I | -(p, q)] times the first two columns of `turn`, and its inverse times the derivative.
  const double b00 = turn[0] - p * turn[6], b01 = turn[1] - p * turn[7];
  const double b10 = turn[3] - q * turn[6], b11 = turn[4] - q * turn[7];
  const double det = b00 * b11 - b01 * b10;
  const double a00 = (b11 * j00 - b01 * j10) / det, a01 = (b11 * j01 - b01 * j11) / det;
  const double a10 = (b00 * j10 - b10 * j00) / det, a11 = (b00 * j11 - b10 * j01) / det;
  // The larger singular value of A is 1 / depth; A times the depth is a rotation's upper left.
  const double s00 = a00 * a00 + a01 * a01, s01 = a00 * a10 + a01 * a11, s11 = a10 * a10 + a11 * a11;
  const double largest = std::sqrt(0.5 * (s00 + s11 + std::sqrt((s00 - s11) * (s00 - s11) + 4 * s01 * s01)));
  if (!(largest > kDegenerate)) return 0;
  const double r00 = a00 / largest, r01 = a01 / largest, r10 = a10 / largest, r11 = a11 / largest;
  // The third row from unit columns; only the sign of both together is open.
  const double b0 = std::sqrt(std::max(0.0, 1 - r00 * r00 - r10 * r10));
  const double b1 = std::sqrt(std::max(0.0, 1 - r01 * r01 - r11 * r11));
  const double sign = -(r00 * r01 + r10 * r11) < 0 ? -1 : 1;
  int found = 0;
  for (const double side : {1.0, -1.0}) {
    const Vec3 x = {r00, r10, side * b0}, y = {r01, r11, side * sign * b1};
    const Vec3 z = cross(x, y);
    Pose pose;
    pose.R = product(turn, Mat3{x[0], y[0], z[0], x[1], y[1], z[1], x[2], y[2], z[2]});
    if (!translation_for(pose.R, places_m, seen, count, pose.t)) continue;
    poses[static_cast<std::size_t>(found++)] = pose;
  }
  return found;
}

}  // namespace berth
