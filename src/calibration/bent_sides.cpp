#include "calibration/bent_sides.hpp"

#include <cmath>
#include <vector>

#include "pose_algebra.hpp"

namespace berth {
namespace {

constexpr int kStations = 32;
// No stations so near a side's ends, where they would see the neighbouring side: a share, and px.
constexpr double kTrimmed = 1.0 / 8, kTrimmed_px = 1;
constexpr double kFarthest_px = 3.0 / 8;

struct Line {
  Vec2 origin, along;
};

// A line through the points by least squares across it, then without those that are too far off.
Line fitted(const std::vector<Vec2>& points, const Vec2& from, const Vec2& to) {
  const double length = std::hypot(to[0] - from[0], to[1] - from[1]);
  const Vec2 along = {(to[0] - from[0]) / length, (to[1] - from[1]) / length};
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

std::array<std::array<double, 2>, 4> bent_side_shift(const CameraModel& camera, const Pose& marker, double size_m) {
  const std::array<Vec3, 4> place = corner_places(size_m);
  const auto seen = [&](double x, double y) { return image_of(camera, transform(marker, {x, y, 0})); };
  std::array<Line, 4> sides;
  for (std::size_t k = 0; k < 4; ++k) {
    const Vec3 &a = place[k], &b = place[(k + 1) % 4];
    const Vec2 from = seen(a[0], a[1]), to = seen(b[0], b[1]);
    const double trim = kTrimmed + kTrimmed_px / std::hypot(to[0] - from[0], to[1] - from[1]);
    std::vector<Vec2> points;
    for (int i = 0; i < kStations; ++i) {
      const double t = trim + (1 - 2 * trim) * i / (kStations - 1);
      points.push_back(seen(a[0] + t * (b[0] - a[0]), a[1] + t * (b[1] - a[1])));
    }
    sides[k] = fitted(points, from, to);
  }
  std::array<std::array<double, 2>, 4> shift{};
  for (std::size_t k = 0; k < 4; ++k) {
    const Vec2 found = meeting(sides[(k + 3) % 4], sides[k]), corner = seen(place[k][0], place[k][1]);
    shift[k] = {found[0] - corner[0], found[1] - corner[1]};
  }
  return shift;
}

}  // namespace berth
