#include "target/reading.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "target/sample_points.hpp"

namespace berth {
namespace {

constexpr double kMinContrast = 4;  // as in shading.cpp
constexpr int kProbes = 16;
constexpr int kMaxProbesWrong = 4;

// A marker's cells vary by at least this share of half the border's contrast, even when the lens blurs them into each
// other; a plain dark or light shape's do not.
constexpr double kMinVariation = 0.25;

// A far smaller share: before the border's shading is known, and where a part of the marker lies in the shadow.
constexpr double kMaxEven = 1.0 / 32;

// Where the local contrast is smaller than this share of the mean, a cell is not taken to the mean contrast in full.
constexpr double kMinLocalContrast = 0.25;

double side_length(const QuadMap& map, double u0, double v0, double u1, double v1) {
  double x0, y0, x1, y1;
  map.at(u0, v0, x0, y0);
  map.at(u1, v1, x1, y1);
  return std::sqrt((x1 - x0) * (x1 - x0) + (y1 - y0) * (y1 - y0));
}

// Area of a module at the corner of the border where it is least, px²: of the parallelogram on that corner's sides,
// which is the area everywhere without perspective.
double least_module_area(const QuadMap& map, double w) {
  const double place[4][2] = {{0, 0}, {w, 0}, {w, w}, {0, w}};
  double x[4], y[4];
  for (int i = 0; i < 4; ++i) map.at(place[i][0], place[i][1], x[i], y[i]);
  double least = std::numeric_limits<double>::infinity();
  for (int i = 0; i < 4; ++i) {
    const int before = (i + 3) & 3, after = (i + 1) & 3;
    const double area = (x[after] - x[i]) * (y[before] - y[i]) - (x[before] - x[i]) * (y[after] - y[i]);
    least = std::min(least, area / (w * w));
  }
  return least;
}

template <class Shading>
Seen fill(View2D<const u8> image, const QuadMap& map, const Layout& layout, const Shading& shading, double spread,
          Reading& reading) {
  const double w = layout.border_width;
  reading.half_contrast = shading.half_contrast();
  reading.module_u_px = (side_length(map, 0, 0, w, 0) + side_length(map, 0, w, w, w)) / (2 * w);
  reading.module_v_px = (side_length(map, 0, 0, 0, w) + side_length(map, w, 0, w, w)) / (2 * w);
  reading.module_area_px2 = least_module_area(map, w);
  // One point a pixel is all there is to know of a cell; more than four by four is more than it takes.
  const auto points_for = [&](double module_px) {
    return std::min(4, std::max(1, static_cast<int>(spread * module_px + 0.5)));
  };
  const int nu = points_for(reading.module_u_px);
  const int nv = points_for(reading.module_v_px);

  const int points = nu * nv;
  double du[4], dv[4];  // of a cell's points from its centre
  for (int k = 0; k < nu; ++k) du[k] = ((k + 0.5) / nu - 0.5) * spread;
  for (int j = 0; j < nv; ++j) dv[j] = ((j + 0.5) / nv - 0.5) * spread;
  double point_u[kMaxPoints], point_v[kMaxPoints];
  int n = 0;
  for (std::size_t i = 0; i < layout.x.size(); ++i) {
    for (int j = 0; j < nv; ++j) {
      for (int k = 0; k < nu; ++k, ++n) {
        point_u[n] = layout.x[i] + 0.5 + du[k];
        point_v[n] = layout.y[i] + 0.5 + dv[j];
      }
    }
  }
  PointSamples samples;
  sample_points(image, map, point_u, point_v, n, samples);

  double mean = 0, square = 0;
  n = 0;
  for (std::size_t i = 0; i < layout.x.size(); ++i) {
    const double u = layout.x[i] + 0.5;
    const double v = layout.y[i] + 0.5;
    double sum = 0;
    bool inside = true;
    for (int k = 0; k < points; ++k, ++n) {
      inside = samples.inside[n] && inside;
      sum += samples.value[n];
    }
    const Tones tones = shading.at(u, v);
    const double local = std::max((tones.light - tones.dark) / 2, kMinLocalContrast * reading.half_contrast);
    const double value = sum / points - (tones.dark + tones.light) / 2;
    reading.value[i] = inside ? value * (reading.half_contrast / local) : 0;
    mean += reading.value[i];
    square += reading.value[i] * reading.value[i];
  }
  const double cells = static_cast<double>(layout.x.size());
  const double least = kMinVariation * reading.half_contrast;
  return square - mean * mean / cells >= cells * least * least ? Seen::cells : Seen::nothing;
}

}  // namespace

double probe_border(View2D<const u8> image, const QuadMap& map, const Layout& layout) {
  std::array<double, kProbes> value;
  std::array<bool, kProbes> is_light;
  double sum[2] = {0, 0};
  int count[2] = {0, 0};
  int n = 0;
  PointSamples samples;
  sample_points(image, map, layout.probe.u.data(), layout.probe.v.data(), kProbes, samples);
  for (std::size_t i = 0; i < kProbes; ++i) {
    if (!samples.inside[i]) continue;
    const bool light = layout.probe.light[i] != 0;
    value[n] = samples.value[i];
    is_light[n] = light;
    sum[light] += value[n];
    ++count[light];
    ++n;
  }
  if (count[0] < 4 || count[1] < 4) return 0;
  const double dark = sum[0] / count[0];
  const double light = sum[1] / count[1];
  if (!(light - dark >= kMinContrast)) return 0;
  const double threshold = (light + dark) / 2;
  int wrong = 0, pairs_right = 0;
  for (int i = 0; i < n; ++i) wrong += (value[i] > threshold) != is_light[i];
  // Under a strong gradient no one threshold fits, but the two rings still differ at every place.
  for (int i = 0; i < n / 2; ++i) pairs_right += (value[i] > value[i + n / 2]) == is_light[i];
  return wrong <= kMaxProbesWrong || (n == kProbes && pairs_right == kProbes / 2) ? light - dark : 0;
}

bool are_cells_even(View2D<const u8> image, const QuadMap& map, const Layout& layout, double contrast) {
  double u[kMaxCells], v[kMaxCells];
  const int cells = static_cast<int>(layout.x.size());
  for (std::size_t i = 0; i < layout.x.size(); ++i) {
    u[i] = layout.x[i] + 0.5;
    v[i] = layout.y[i] + 0.5;
  }
  PointSamples samples;
  sample_points(image, map, u, v, cells, samples);
  double mean = 0, square = 0;
  for (int i = 0; i < cells; ++i) {
    mean += samples.value[i];
    square += samples.value[i] * samples.value[i];
  }
  const double most = kMaxEven * contrast / 2;
  return square - mean * mean / cells < cells * most * most;
}

Seen read_cells(View2D<const u8> image, const QuadMap& map, const Layout& layout, const PlaneShading& shading,
                double spread, Reading& reading) {
  return fill(image, map, layout, shading, spread, reading);
}
Seen read_cells(View2D<const u8> image, const QuadMap& map, const Layout& layout, const EdgeShading& shading,
                double spread, Reading& reading) {
  return fill(image, map, layout, shading, spread, reading);
}

}  // namespace berth
