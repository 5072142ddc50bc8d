#include "target/shading.hpp"

#include <algorithm>
#include <cassert>
#include <cmath>

#include "target/sample.hpp"
#include "target/sample_points.hpp"

namespace berth {
namespace {

// Below this the border is not told from noise of two or three grey levels.
constexpr double kMinContrast = 4;

// A marker of small modules under blur and noise still shows most of its ring; shapes that only happen to have four
// corners do not. Measured on rendered markers of 12 to 30 px and on quadrilaterals over textures.
constexpr double kMaxRingWrong = 0.25;

// Least-squares plane g(u, v) = c + a·u + b·v over points.
struct PlaneFit {
  double n = 0, u = 0, v = 0, uu = 0, uv = 0, vv = 0, g = 0, gu = 0, gv = 0;

  void add(double pu, double pv, double value) {
    n += 1;
    u += pu;
    v += pv;
    uu += pu * pu;
    uv += pu * pv;
    vv += pv * pv;
    g += value;
    gu += value * pu;
    gv += value * pv;
  }
};

struct Plane {
  double a = 0, b = 0, c = 0;

  explicit Plane(const PlaneFit& f) {
    const double mean_u = f.u / f.n, mean_v = f.v / f.n, mean = f.g / f.n;
    const double uu = f.uu - f.u * mean_u, uv = f.uv - f.u * mean_v, vv = f.vv - f.v * mean_v;
    const double gu = f.gu - f.g * mean_u, gv = f.gv - f.g * mean_v;
    const double det = uu * vv - uv * uv;
    if (det > 1e-3 * uu * vv) {  // else the points lie on a line (a marker at the image's edge): stay flat
      a = (gu * vv - gv * uv) / det;
      b = (gv * uu - gu * uv) / det;
    }
    c = mean - a * mean_u - b * mean_v;
  }
};

}  // namespace

bool PlaneShading::fit(View2D<const u8> image, const QuadMap& map, const Layout& layout) {
  middle_ = layout.border_width / 2.0;
  const RingPoints& ring = layout.ring;
  const std::size_t n = ring.u.size();
  PointSamples samples;
  sample_points(image, map, ring.u.data(), ring.v.data(), static_cast<int>(n), samples);
  int points = 0;
  PlaneFit fit[2];
  for (std::size_t i = 0; i < n; ++i) {
    if (!samples.inside[i]) continue;
    ++points;
    fit[ring.light[i] != 0].add(ring.u[i] - middle_, ring.v[i] - middle_, samples.value[i]);
  }
  if (fit[0].n < 6 || fit[1].n < 6) return false;
  const Plane dark(fit[0]), light(fit[1]);
  dark_ = {dark.c, dark.a, dark.b};
  light_ = {light.c, light.a, light.b};
  if (!(half_contrast() >= kMinContrast / 2)) return false;

  int wrong = 0;
  double squares = 0;
  for (std::size_t i = 0; i < n; ++i) {
    if (!samples.inside[i]) continue;
    const bool is_light = ring.light[i] != 0;
    const double value = samples.value[i];
    const Tones tones = at(ring.u[i], ring.v[i]);
    wrong += (value > (tones.dark + tones.light) / 2) != is_light;
    const double error = value - (is_light ? tones.light : tones.dark);
    squares += error * error;
  }
  misfit_ = std::sqrt(squares / points) / half_contrast();
  return wrong <= kMaxRingWrong * points;
}

bool EdgeShading::fit(View2D<const u8> image, const QuadMap& map, const Layout& layout) {
  border_width_ = layout.border_width;
  assert(border_width_ <= kMaxBorder);
  const double w = border_width_;
  int right = 0;
  double contrast = 0;
  for (const bool inside : {true, false}) {
    Ring& ring = inside == layout.reversed_border ? light_ : dark_;
    ring.first = inside ? 0.5 : -0.5;
    ring.last = w - ring.first;
    for (int i = 0; i < border_width_; ++i) {
      const double along = i + 0.5;
      const double place[4][2] = {{ring.first, along}, {ring.last, along}, {along, ring.first}, {along, ring.last}};
      for (std::size_t side = 0; side < 4; ++side) {
        double x, y;
        map.at(place[side][0], place[side][1], x, y);
        if (!sample(image, x, y, ring.side[side][i])) return false;
      }
    }
  }
  for (std::size_t side = 0; side < 4; ++side) {
    for (int i = 0; i < border_width_; ++i) {
      const double difference = light_.side[side][i] - dark_.side[side][i];
      right += difference > 0;
      contrast += difference;
    }
  }
  half_contrast_ = contrast / (8 * w);
  if (!(half_contrast_ >= kMinContrast / 2) || right < (1 - kMaxRingWrong) * 4 * w) return false;

  for (Ring* ring : {&dark_, &light_}) {
    for (auto& side : ring->side) {
      const auto raw = side;
      for (int i = 0; i < border_width_; ++i) {
        side[i] = (raw[std::max(i - 1, 0)] + 2 * raw[i] + raw[std::min(i + 1, border_width_ - 1)]) / 4;
      }
    }
  }
  return true;
}

double EdgeShading::blend(const Ring& ring, double u, double v) const {
  const int end = border_width_ - 1;
  const int column = std::min(end, std::max(0, static_cast<int>(u)));
  const int row = std::min(end, std::max(0, static_cast<int>(v)));
  // Cells outside the border (reversed families) take the tones of the nearest side.
  const double s = std::min(1.0, std::max(0.0, (u - ring.first) / (ring.last - ring.first)));
  const double t = std::min(1.0, std::max(0.0, (v - ring.first) / (ring.last - ring.first)));
  const auto& left = ring.side[0];
  const auto& right = ring.side[1];
  const auto& top = ring.side[2];
  const auto& bottom = ring.side[3];
  const double corners = (1 - s) * (1 - t) * (left[0] + top[0]) + s * (1 - t) * (right[0] + top[end]) +
                         (1 - s) * t * (left[end] + bottom[0]) + s * t * (right[end] + bottom[end]);
  return (1 - s) * left[row] + s * right[row] + (1 - t) * top[column] + t * bottom[column] - corners / 2;
}

Tones EdgeShading::at(double u, double v) const { return {blend(dark_, u, v), blend(light_, u, v)}; }

}  // namespace berth
