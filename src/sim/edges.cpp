#include "sim/edges.hpp"

#include <algorithm>
#include <cmath>

namespace berth::sim {
namespace {

// Distance of the points along an edge, and half the side of the square that each marks. A chord through a pixel has a
// point within a quarter of a pixel of its middle, so that the square touches the pixel.
constexpr double kStep_px = 0.5;
constexpr double kReach_px = 0.3;
// The lens stretches less than this anywhere in an image worth rendering.
constexpr double kMostStretch = 1.3;

class Marker {
 public:
  Marker(const Layer& layer, const RayMap& rays, u64 bit, std::vector<u64>& flags)
      : layer_(layer), rays_(rays), camera_(rays.camera()), bit_(bit), flags_(flags) {}

  // The straight edge from a to b of the plane.
  void edge(const Vec2& a, const Vec2& b) {
    const Vec3 pa = layer_.camera_point(a), pb = layer_.camera_point(b);
    if (pa[2] < kNear_m && pb[2] < kNear_m) return;
    const auto ray = [&](const Vec3& from, const Vec3& to) -> Vec2 {
      if (from[2] >= kNear_m) return {from[0] / from[2], from[1] / from[2]};
      const double s = (kNear_m - from[2]) / (to[2] - from[2]);
      return {(from[0] + s * (to[0] - from[0])) / kNear_m, (from[1] + s * (to[1] - from[1])) / kNear_m};
    };
    walk(ray(pa, pb), ray(pb, pa));
  }

 private:
  void walk(const Vec2& a, const Vec2& b) {
    double from = 0, to = 1;
    for (std::size_t i = 0; i < 2; ++i) {
      // Liang & Barsky's clipping against the box of all rays.
      const double d = b[i] - a[i];
      const double slack = 1e-3 * (rays_.high()[i] - rays_.low()[i]);
      const double low = rays_.low()[i] - slack - a[i], high = rays_.high()[i] + slack - a[i];
      if (d == 0) {
        if (low > 0 || high < 0) return;
        continue;
      }
      from = std::max(from, std::min(low / d, high / d));
      to = std::min(to, std::max(low / d, high / d));
    }
    if (!(from < to)) return;
    const double dx = (b[0] - a[0]) * camera_.fx, dy = (b[1] - a[1]) * camera_.fy;
    const double length_px = std::sqrt(dx * dx + dy * dy) * (to - from) * kMostStretch;
    const int steps = static_cast<int>(length_px / kStep_px) + 1;
    const double step = (to - from) / steps;
    for (int i = 0; i <= steps; ++i) {
      const double s = from + step * i;
      const Vec2 p = image_point(camera_, {a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1])});
      // Half a pixel for the pixel's corner; one more to round towards zero where floor is meant.
      const int left = static_cast<int>(p[0] + (1.5 - kReach_px)) - 1,
                right = static_cast<int>(p[0] + (1.5 + kReach_px)) - 1;
      const int top = static_cast<int>(p[1] + (1.5 - kReach_px)) - 1,
                bottom = static_cast<int>(p[1] + (1.5 + kReach_px)) - 1;
      set(left, top);
      set(right, top);
      set(left, bottom);
      set(right, bottom);
    }
  }

  void set(int x, int y) {
    if (x < 0 || y < 0 || x >= camera_.width || y >= camera_.height) return;
    flags_[static_cast<std::size_t>(y) * static_cast<std::size_t>(camera_.width) + static_cast<std::size_t>(x)] |= bit_;
  }

  const Layer& layer_;
  const RayMap& rays_;
  const CameraModel& camera_;
  u64 bit_;
  std::vector<u64>& flags_;
};

// The chords of 128 sides leave the circle by 0.0003 of the radius: 0.1 px at 300 px.
constexpr int kCircleSides = 128;

const std::array<Vec2, kCircleSides>& unit_circle() {
  static const std::array<Vec2, kCircleSides> points = [] {
    std::array<Vec2, kCircleSides> result{};
    for (int i = 0; i < kCircleSides; ++i) {
      const double angle = 2 * kPi / kCircleSides * i;
      result[static_cast<std::size_t>(i)] = {exact_cos(angle), exact_sin(angle)};
    }
    return result;
  }();
  return points;
}

void mark_circle(Marker& marker, double radius) {
  Vec2 before = {radius, 0};
  for (int i = kCircleSides - 1; i >= 0; --i) {
    const Vec2& unit = unit_circle()[static_cast<std::size_t>(i)];
    const Vec2 point = {radius * unit[0], radius * unit[1]};
    marker.edge(before, point);
    before = point;
  }
}

// Lines between unequal cells; `along` walks the line, `across` crosses it.
template <class Differs, class Edge>
void mark_lines(int across_count, int along_count, const Differs& differs, const Edge& edge) {
  for (int across = 1; across < across_count; ++across) {
    for (int along = 0; along < along_count;) {
      if (!differs(across, along)) {
        ++along;
        continue;
      }
      int end = along + 1;
      while (end < along_count && differs(across, end)) ++end;
      edge(across, along, end);
      along = end;
    }
  }
}

}  // namespace

void mark_edges(const Layer& layer, const RayMap& rays, u64 bit, std::vector<u64>& flags) {
  const Surface& s = layer.surface();
  Marker marker(layer, rays, bit, flags);
  if (layer.disc()) {
    mark_circle(marker, s.outer_radius);
    if (s.inner_radius > 0) mark_circle(marker, s.inner_radius);
  } else {
    for (std::size_t i = 0; i < s.outline.size(); ++i) {
      marker.edge(s.outline[i], s.outline[(i + 1) % s.outline.size()]);
    }
  }
  const auto cell = [&](int column, int row) {
    return s
        .cells[static_cast<std::size_t>(row) * static_cast<std::size_t>(s.columns) + static_cast<std::size_t>(column)];
  };
  const auto x = [&](int column) { return s.left + column * s.cell_width; };
  const auto y = [&](int row) { return s.top + row * s.cell_height; };
  mark_lines(
      s.columns, s.rows, [&](int c, int r) { return cell(c - 1, r) != cell(c, r); },
      [&](int c, int first, int end) {
        marker.edge({x(c), y(first)}, {x(c), y(end)});
      });
  mark_lines(
      s.rows, s.columns, [&](int r, int c) { return cell(c, r - 1) != cell(c, r); },
      [&](int r, int first, int end) {
        marker.edge({x(first), y(r)}, {x(end), y(r)});
      });
}

}  // namespace berth::sim
