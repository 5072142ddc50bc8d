#include "target/pattern_cells.hpp"

#include <algorithm>
#include <cassert>

namespace berth {
namespace {

enum : signed char { kDark = 0, kLight = 1, kOpen = 2 };
using Modules = std::array<std::array<signed char, PatternCells::kMost>, PatternCells::kMost>;

void draw_ring(Modules& modules, int first, int last, signed char tone) {
  last = std::min(last, PatternCells::kMost - 1);  // it is: for GCC 14, which does not know how wide families are
  for (int i = first; i <= last; ++i) {
    const std::size_t at = static_cast<std::size_t>(i);
    const std::size_t a = static_cast<std::size_t>(first), b = static_cast<std::size_t>(last);
    modules[a][at] = modules[b][at] = modules[at][a] = modules[at][b] = tone;
  }
}

PatternCell cell_of(const std::array<std::array<signed char, 3>, 3>& seen) {
  PatternCell cell;
  bool alike = true;
  for (std::size_t j = 0; j < 3; ++j) {
    for (const signed char tone : seen[j]) {
      if (tone == kOpen) return {};
      alike = alike && tone == seen[0][0];
    }
    cell.left[j] = seen[j][0];
    cell.middle[j] = static_cast<signed char>(seen[j][1] - seen[j][0]);
    cell.right[j] = static_cast<signed char>(seen[j][2] - seen[j][1]);
  }
  cell.kind = alike ? PatternCell::kEven : PatternCell::kEdges;
  return cell;
}

// From the modules before and after two lines: upper left, upper right, lower left, lower right.
void set_node(const std::array<signed char, 4>& seen, std::size_t at, PatternNodes& nodes) {
  bool known = true;
  for (const signed char tone : seen) known = known && tone != kOpen;
  const auto sum = [&](int a, int b, int c, int d) {
    return static_cast<signed char>(known ? 8 * (a * seen[0] + b * seen[1] + c * seen[2] + d * seen[3]) : 0);
  };
  nodes.even[at] = sum(1, 1, 1, 1);
  nodes.by_u[at] = sum(-1, 1, -1, 1);
  nodes.by_v[at] = sum(-1, -1, 1, 1);
  nodes.both[at] = sum(1, -1, -1, 1);
  nodes.known[at] = known ? -1 : 0;
}

}  // namespace

void PatternCells::set(const MarkerFamily& family, int id) {
  const int border = family.border_width;
  // The ring just outside the border belongs to every family, printed or not.
  const int margin = std::max(1, (family.total_width - border) / 2);
  first_ = -margin;
  width_ = border + 2 * margin;
  assert(width_ <= kMost);

  Modules modules;
  for (auto& row : modules) row.fill(kOpen);
  draw_ring(modules, margin, margin + border - 1, family.reversed_border ? kLight : kDark);
  draw_ring(modules, margin - 1, margin + border, family.reversed_border ? kDark : kLight);
  const std::size_t bits = family.bit_x.size();
  for (std::size_t i = 0; i < bits; ++i) {
    const bool light = ((family.codes[static_cast<std::size_t>(id)] >> (bits - 1 - i)) & 1) != 0;
    modules[static_cast<std::size_t>(family.bit_y[i] + margin)][static_cast<std::size_t>(family.bit_x[i] + margin)] =
        light ? kLight : kDark;
  }

  const auto inside = [&](int i) { return static_cast<std::size_t>(std::min(width_ - 1, std::max(0, i))); };
  for (int row = 0; row < width_; ++row) {
    for (int column = 0; column < width_; ++column) {
      std::array<std::array<signed char, 3>, 3> seen;
      for (int dy = 0; dy < 3; ++dy) {
        for (int dx = 0; dx < 3; ++dx) {
          seen[static_cast<std::size_t>(dy)][static_cast<std::size_t>(dx)] =
              modules[inside(row + dy - 1)][inside(column + dx - 1)];
        }
      }
      cells_[static_cast<std::size_t>(row * kMost + column)] = cell_of(seen);
    }
  }
  for (int row = first_ - 2; row <= last() + 3; ++row) {
    for (int column = first_ - 2; column <= last() + 3; ++column) {
      std::array<signed char, 4> seen;
      for (int k = 0; k < 4; ++k) {
        seen[static_cast<std::size_t>(k)] =
            modules[inside(row - 1 + k / 2 - first_)][inside(column - 1 + k % 2 - first_)];
      }
      set_node(seen, node(column, row), nodes_);
    }
  }
}

}  // namespace berth
