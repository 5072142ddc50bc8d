#include <algorithm>
#include <vector>

#include "reference/layout.hpp"
#include "reference/reference.hpp"

namespace berth::reference {
namespace {

struct Contour {
  int nodes = 0;
  int area = 0;        // positive for outlines
  int horizontal = 0;  // sum of |dx|
  int x_min = 1 << 30, x_max = 0, y_min = 1 << 30, y_max = -(1 << 30);
  int first_outline_top = -1;
  int first_hole_top = -1;
};

int step_of(u32 node) {
  const int step = static_cast<int>(node >> 16);
  return step < 0x8000 ? step : step - 0x10000;
}

Contour follow(const u32* nodes, int begin, std::vector<bool>& seen) {
  Contour contour;
  int id = begin;
  int y = 0;
  do {
    seen[static_cast<std::size_t>(id)] = true;
    const int x = static_cast<int>(nodes[id] & 0xffffu);
    const int step = step_of(nodes[id]);
    const int next = id + step;
    const bool start = id % 2 == 0;
    ++contour.nodes;
    contour.area += start ? -x : x;
    contour.horizontal += std::abs(static_cast<int>(nodes[next] & 0xffffu) - x);
    contour.x_min = std::min(contour.x_min, x);
    contour.x_max = std::max(contour.x_max, x);
    contour.y_min = std::min(contour.y_min, y);
    contour.y_max = std::max(contour.y_max, y);
    int& top = step == 1 ? contour.first_outline_top : contour.first_hole_top;
    if (start && (step == 1 || step == -1) && (top < 0 || id < top)) top = id;
    if (step % 2 == 0) y += start ? -1 : 1;
    id = next;
  } while (id != begin);
  return contour;
}

}  // namespace

// For every closed contour that may be a quadrilateral, its number of nodes, at the run of its first top; holes have
// the top bit set. All other runs get 0. Then, for each group of 128 runs, the contours and the points it begins.
void contour_measure(const contour_measure_params& p, const u32* nodes, const u32* offsets, u32* spans) {
  std::fill(spans, spans + p.groups * 128, 0u);
  const int kept = kept_run_ends(offsets, p.base_at, p.height, p.row_words, p.capacity);
  std::vector<bool> seen(static_cast<std::size_t>(kept));
  for (int id = 0; id < kept; ++id) {
    if (seen[static_cast<std::size_t>(id)]) continue;
    const Contour contour = follow(nodes, id, seen);
    const bool hole = contour.area < 0;
    if (hole ? p.want_holes == 0 : p.want_outer == 0) continue;
    const int width = contour.x_max - contour.x_min;
    const int height = contour.y_max - contour.y_min + 1;
    const bool sized = std::abs(contour.area) >= p.min_area && std::min(width, height) >= p.min_side &&
                       std::max(width, height) <= p.max_side;
    const bool convex = contour.nodes <= height * 5 / 2 + 4 && contour.horizontal <= width * 5 / 2 + 4;
    if (!sized || !convex) continue;
    const int first = hole ? contour.first_hole_top : contour.first_outline_top;
    spans[first / 2] = static_cast<u32>(contour.nodes) | (hole ? CONTOUR_HOLE : 0u);
  }
  for (int group = 0; group < p.groups; ++group) {
    u32 contours = 0;
    u32 points = 0;
    for (int run = group * 128; run < group * 128 + 128; ++run) {
      if (spans[run] == 0) continue;
      ++contours;
      points += spans[run] & ~CONTOUR_HOLE;
    }
    spans[p.totals_at + group] = contours;
    spans[p.totals_at + p.groups + 1 + group] = points;
  }
}

}  // namespace berth::reference
