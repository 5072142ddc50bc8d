#include "target/reading.hpp"

#include <algorithm>
#include <cmath>

namespace berth {
namespace {

// Below this the border is not told from noise of two or three grey levels.
constexpr double kMinContrast = 4;

// A marker of small modules under blur and noise still shows most of its ring; shapes that only happen to have four
// corners do not. Measured on rendered markers of 12 to 30 px and on quadrilaterals over textures.
constexpr int kMaxProbesWrong = 4;
constexpr double kMaxRingWrong = 0.25;

// A marker's cells vary by at least this share of half the border's contrast, even when the lens blurs them into each
// other; a plain dark or light shape's do not.
constexpr double kMinVariation = 0.25;

// Bilinear interpolation; pixel centres at integers. Returns false outside the image.
inline bool sample(View2D<const u8> image, double x, double y, double& value) {
  if (!(x > -0.5 && y > -0.5 && x < image.width - 0.5 && y < image.height - 0.5)) return false;
  // The half pixel outside the outermost centres takes their value.
  x = std::min(std::max(x, 0.0), static_cast<double>(image.width - 1));
  y = std::min(std::max(y, 0.0), static_cast<double>(image.height - 1));
  const int ix = std::min(static_cast<int>(x), std::max(image.width - 2, 0));
  const int iy = std::min(static_cast<int>(y), std::max(image.height - 2, 0));
  const double fx = x - ix;
  const double fy = y - iy;
  const int right = image.width > 1 ? 1 : 0;
  const u8* const above = image.row(iy) + ix;
  const u8* const below = image.height > 1 ? above + image.stride : above;
  const double top = above[0] + (above[right] - above[0]) * fx;
  const double bottom = below[0] + (below[right] - below[0]) * fx;
  value = top + (bottom - top) * fy;
  return true;
}

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
  double at(double pu, double pv) const { return c + a * pu + b * pv; }
};

double side_length(const QuadMap& map, double u0, double v0, double u1, double v1) {
  double x0, y0, x1, y1;
  map.at(u0, v0, x0, y0);
  map.at(u1, v1, x1, y1);
  return std::sqrt((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0));
}

}  // namespace

bool probe_border(View2D<const u8> image, const QuadMap& map, const Layout& layout) {
  std::array<double, 16> value;
  std::array<bool, 16> is_light;
  double sum[2] = {0, 0};
  int count[2] = {0, 0};
  int n = 0;
  for (const RingPoint& p : layout.probe) {
    double x, y;
    map.at(p.u, p.v, x, y);
    if (!sample(image, x, y, value[n])) continue;
    is_light[n] = p.light;
    sum[p.light] += value[n];
    ++count[p.light];
    ++n;
  }
  if (count[0] < 4 || count[1] < 4) return false;
  const double dark = sum[0] / count[0];
  const double light = sum[1] / count[1];
  if (!(light - dark >= kMinContrast)) return false;
  const double threshold = (light + dark) / 2;
  int wrong = 0;
  for (int i = 0; i < n; ++i) wrong += (value[i] > threshold) != is_light[i];
  return wrong <= kMaxProbesWrong;
}

bool read_cells(View2D<const u8> image, const QuadMap& map, const Layout& layout, double spread, Reading& reading) {
  const double w = layout.border_width;
  const double middle = w / 2;

  constexpr int kMaxRing = 128;
  struct Seen {
    double u, v, value;
    bool light;
  };
  std::array<Seen, kMaxRing> ring;
  int points = 0;
  PlaneFit fit[2];
  for (const RingPoint& p : layout.ring) {
    double x, y, value;
    map.at(p.u, p.v, x, y);
    if (!sample(image, x, y, value)) continue;
    ring[points++] = {p.u - middle, p.v - middle, value, p.light};
    fit[p.light].add(p.u - middle, p.v - middle, value);
  }
  if (fit[0].n < 6 || fit[1].n < 6) return false;
  const Plane dark(fit[0]);
  const Plane light(fit[1]);
  if (!(light.c - dark.c >= kMinContrast)) return false;
  reading.half_contrast = (light.c - dark.c) / 2;

  int wrong = 0;
  double squares = 0;
  for (int i = 0; i < points; ++i) {
    const Seen& s = ring[i];
    const double d = dark.at(s.u, s.v);
    const double l = light.at(s.u, s.v);
    wrong += (s.value > (d + l) / 2) != s.light;
    const double error = s.value - (s.light ? l : d);
    squares += error * error;
  }
  reading.ring_wrong = static_cast<double>(wrong) / points;
  reading.ring_sigma = std::sqrt(squares / points);
  if (reading.ring_wrong > kMaxRingWrong) return false;

  reading.module_u_px = (side_length(map, 0, 0, w, 0) + side_length(map, 0, w, w, w)) / (2 * w);
  reading.module_v_px = (side_length(map, 0, 0, 0, w) + side_length(map, w, 0, w, w)) / (2 * w);
  // One point a pixel is all there is to know of a cell; more than four by four is more than it takes.
  const auto points_for = [&](double module_px) {
    return std::min(4, std::max(1, static_cast<int>(spread * module_px + 0.5)));
  };
  const int nu = points_for(reading.module_u_px);
  const int nv = points_for(reading.module_v_px);

  reading.complete = true;
  double mean = 0, square = 0;
  for (std::size_t i = 0; i < layout.x.size(); ++i) {
    const double u = layout.x[i] + 0.5;
    const double v = layout.y[i] + 0.5;
    double sum = 0;
    bool inside = true;
    for (int j = 0; j < nv; ++j) {
      for (int k = 0; k < nu; ++k) {
        double x, y, value = 0;
        map.at(u + ((k + 0.5) / nu - 0.5) * spread, v + ((j + 0.5) / nv - 0.5) * spread, x, y);
        inside = sample(image, x, y, value) && inside;
        sum += value;
      }
    }
    const double threshold = (dark.at(u - middle, v - middle) + light.at(u - middle, v - middle)) / 2;
    reading.value[i] = inside ? sum / (nu * nv) - threshold : 0;
    reading.complete = reading.complete && inside;
    mean += reading.value[i];
    square += reading.value[i] * reading.value[i];
  }
  const double cells = static_cast<double>(layout.x.size());
  const double least = kMinVariation * reading.half_contrast;
  return square - mean * mean / cells >= cells * least * least;
}

}  // namespace berth
