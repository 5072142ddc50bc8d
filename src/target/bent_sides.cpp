#include "target/bent_sides.hpp"

#include <cmath>

#include "pose_algebra.hpp"

namespace berth {
namespace {

constexpr std::size_t kStations = 32;
// No stations so near a side's ends, where they would see the neighbouring side: a share, and px.
constexpr double kTrimmed = 1.0 / 8, kTrimmed_px = 1;
constexpr double kFarthest_px = 3.0 / 8;
// The shift is told from corners that are themselves shifted: each round leaves about a hundredth of what was wrong.
constexpr int kRounds = 2;
// Of the side: no lens that markers are read through bends more.
constexpr double kMostShare = 1.0 / 8;

using Corners4 = std::array<Vec2, 4>;

struct Line {
  Vec2 origin, along;
};

double distance(const Vec2& a, const Vec2& b) {
  const double dx = b[0] - a[0], dy = b[1] - a[1];
  return std::sqrt(dx * dx + dy * dy);
}

// A line through the points by least squares across it, then without those that are too far off.
Line fitted(const std::array<Vec2, kStations>& points, const Vec2& from, const Vec2& to) {
  const double side = distance(from, to);
  const Vec2 along = {(to[0] - from[0]) / side, (to[1] - from[1]) / side};
  double middle = 0, rise = 0;  // the offset is middle + rise · (way from `from`)
  for (int pass = 0; pass < 2; ++pass) {
    double n = 0, sx = 0, sy = 0, sxx = 0, sxy = 0;
    for (const Vec2& p : points) {
      const double dx = p[0] - from[0], dy = p[1] - from[1];
      const double way = dx * along[0] + dy * along[1], off = dy * along[0] - dx * along[1];
      if (pass > 0 && std::fabs(off - middle - rise * way) > kFarthest_px) continue;
      n += 1;
      sx += way;
      sy += off;
      sxx += way * way;
      sxy += way * off;
    }
    const double det = n * sxx - sx * sx;
    if (!(det > 0)) break;
    middle = (sxx * sy - sx * sxy) / det;
    rise = (n * sxy - sx * sy) / det;
  }
  return {{from[0] - middle * along[1], from[1] + middle * along[0]},
          {along[0] - rise * along[1], along[1] + rise * along[0]}};
}

Vec2 meeting(const Line& a, const Line& b) {
  const double det = a.along[0] * b.along[1] - a.along[1] * b.along[0];
  const double dx = b.origin[0] - a.origin[0], dy = b.origin[1] - a.origin[1];
  const double way = (dx * b.along[1] - dy * b.along[0]) / det;
  return {a.origin[0] + way * a.along[0], a.origin[1] + way * a.along[1]};
}

}  // namespace

Corners4 bent_side_shift(const CameraModel& camera, const Corners4& rays) {
  Corners4 corners;
  for (std::size_t k = 0; k < 4; ++k) corners[k] = camera.project(rays[k][0], rays[k][1]);
  std::array<Line, 4> sides;
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t next = (k + 1) % 4;
    const double trim = kTrimmed + kTrimmed_px / distance(corners[k], corners[next]);
    std::array<Vec2, kStations> points;
    for (std::size_t i = 0; i < kStations; ++i) {
      const double t = trim + (1 - 2 * trim) * static_cast<double>(i) / (kStations - 1);
      points[i] =
          camera.project(rays[k][0] + t * (rays[next][0] - rays[k][0]), rays[k][1] + t * (rays[next][1] - rays[k][1]));
    }
    sides[k] = fitted(points, corners[k], corners[next]);
  }
  Corners4 shift{};
  for (std::size_t k = 0; k < 4; ++k) {
    const Vec2 found = meeting(sides[(k + 3) % 4], sides[k]);
    shift[k] = {found[0] - corners[k][0], found[1] - corners[k][1]};
  }
  return shift;
}

void straighten_corners(const CameraModel& camera, Corners4& corners_px) {
  const Corners4 found = corners_px;
  for (int round = 0; round < kRounds; ++round) {
    Corners4 rays;
    for (std::size_t k = 0; k < 4; ++k) rays[k] = camera.undistort(corners_px[k][0], corners_px[k][1]);
    const Corners4 shift = bent_side_shift(camera, rays);
    for (std::size_t k = 0; k < 4; ++k) corners_px[k] = {found[k][0] - shift[k][0], found[k][1] - shift[k][1]};
  }
  for (std::size_t k = 0; k < 4; ++k) {
    if (!(distance(corners_px[k], found[k]) < kMostShare * distance(found[k], found[(k + 1) % 4]))) {
      corners_px = found;  // where the model does not hold, at a fisheye's rim
      return;
    }
  }
}

}  // namespace berth
