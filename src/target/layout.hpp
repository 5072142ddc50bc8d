#pragma once

#include <vector>

#include "berth/constant_memory.hpp"
#include "berth/marker.hpp"

namespace berth {

/// Most data bits a family may have: a code is one u64.
constexpr int kMaxCells = 64;

/// Places to sample, in modules from the border's upper left.
struct RingPoints {
  std::vector<double> u, v;
  std::vector<char> light;  // whether paper is light there

  void add(double at_u, double at_v, bool is_light) {
    u.push_back(at_u);
    v.push_back(at_v);
    light.push_back(is_light ? 1 : 0);
  }
};

/// Where a group of families has its border and its data, whatever the codes.
struct Layout {
  /// What lies beside a data cell: a data cell (its index), or one of these.
  enum Neighbour : int { kDark = -1, kLight = -2, kUnknown = -3 };

  explicit Layout(const MarkerFamily& family);
  /// Whether the family's data cells are these, in any order.
  bool fits(const MarkerFamily& family) const;
  /// The cell at a place; -1 where there is none.
  int cell_at(int column, int row) const;

  void list_constants(std::vector<ConstantMemory>& to) const;

  int border_width = 0;
  bool reversed_border = false;
  /// How far anything sampled reaches outside the border, modules.
  double reach = 0;
  /// Column and row of each data cell, row by row.
  std::vector<int> x, y;
  /// The eight neighbours of each cell, row by row without the cell itself: [cells][8].
  std::vector<int> neighbours;
  /// The border's dark and light rings, one point a module.
  RingPoints ring;
  /// Sixteen places, enough to tell most quadrilaterals from a marker: eight inside, then the eight beside them
  /// outside.
  RingPoints probe;
};

}  // namespace berth
