#include "target/layout.hpp"

#include <algorithm>
#include <cassert>
#include <utility>

namespace berth {
namespace {

std::vector<std::pair<int, int>> places(const MarkerFamily& family) {
  std::vector<std::pair<int, int>> result;
  for (std::size_t i = 0; i < family.bit_x.size(); ++i) result.emplace_back(family.bit_y[i], family.bit_x[i]);
  std::sort(result.begin(), result.end());
  return result;
}

// The printed module at (x, y) when it is no data cell.
int printed(const MarkerFamily& family, int x, int y) {
  const int w = family.border_width;
  const int margin = (family.total_width - w) / 2;
  if (x < -margin || y < -margin || x >= w + margin || y >= w + margin) return Layout::kUnknown;
  const int depth = std::min(std::min(x, w - 1 - x), std::min(y, w - 1 - y));  // 0 on the border's inner ring
  const int light_depth = family.reversed_border ? 0 : -1;
  return depth == light_depth ? Layout::kLight : Layout::kDark;
}

}  // namespace

Layout::Layout(const MarkerFamily& family)
    : border_width(family.border_width),
      reversed_border(family.reversed_border),
      reach(std::max(1, (family.total_width - family.border_width) / 2)) {
  assert(family.bit_x.size() <= kMaxCells);
  for (const auto& [row, column] : places(family)) {
    x.push_back(column);
    y.push_back(row);
  }
  for (std::size_t i = 0; i < x.size(); ++i) {
    for (int dy = -1; dy <= 1; ++dy) {
      for (int dx = -1; dx <= 1; ++dx) {
        if (dx == 0 && dy == 0) continue;
        const int cell = cell_at(x[i] + dx, y[i] + dy);
        neighbours.push_back(cell >= 0 ? cell : printed(family, x[i] + dx, y[i] + dy));
      }
    }
  }

  const double w = border_width;
  for (const bool inside : {true, false}) {
    const bool light = inside == reversed_border;
    const double near_side = inside ? 0.5 : -0.5;
    const double far_side = w - near_side;
    for (int i = 0; i < border_width; ++i) {
      const double along = i + 0.5;
      ring.add(near_side, along, light);
      ring.add(far_side, along, light);
      if (inside && (i == 0 || i == border_width - 1)) continue;  // the corner modules are there already
      ring.add(along, near_side, light);
      ring.add(along, far_side, light);
    }
    for (const double along : {0.25 * w, 0.75 * w}) {
      probe.add(near_side, along, light);
      probe.add(far_side, along, light);
      probe.add(along, near_side, light);
      probe.add(along, far_side, light);
    }
  }
}

bool Layout::fits(const MarkerFamily& family) const {
  if (family.border_width != border_width || family.reversed_border != reversed_border) return false;
  if (family.bit_x.size() != x.size()) return false;
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (cell_at(family.bit_x[i], family.bit_y[i]) < 0) return false;
  }
  return true;
}

int Layout::cell_at(int column, int row) const {
  for (std::size_t i = 0; i < x.size(); ++i) {
    if (x[i] == column && y[i] == row) return static_cast<int>(i);
  }
  return -1;
}

void Layout::list_constants(std::vector<ConstantMemory>& to) const {
  for (const std::vector<int>* cells : {&x, &y, &neighbours}) add_constants("layout", *cells, to);
  for (const RingPoints* points : {&ring, &probe}) {
    add_constants("layout", points->u, to);
    add_constants("layout", points->v, to);
    add_constants("layout", points->light, to);
  }
}

}  // namespace berth
