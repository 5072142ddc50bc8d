#pragma once

#include "berth/image.hpp"
#include "target/layout.hpp"
#include "target/quad_map.hpp"

namespace berth {

/// Most points sampled at once: four by four a cell.
constexpr int kMaxPoints = 16 * kMaxCells;

/// Grey levels at points, 0 for those outside the image, and which are inside.
struct PointSamples {
  double value[kMaxPoints];
  bool inside[kMaxPoints];
};

/// sample() at the image points of the map's points (u[i], v[i]), i < n <= kMaxPoints.
void sample_points(View2D<const u8> image, const QuadMap& map, const double* u, const double* v, int n,
                   PointSamples& samples);

}  // namespace berth
