#pragma once

#include <array>

#include "berth/image.hpp"
#include "target/layout.hpp"
#include "target/quad_map.hpp"

namespace berth {

/// What the image shows at the cells of a layout.
struct Reading {
  /// Grey level of each cell minus its threshold: the mean of the light and the dark plane there.
  std::array<double, kMaxCells> value;
  /// Cells, or part of them, outside the image read 0.
  bool complete = true;
  /// Half the difference between the light and the dark plane at the marker's centre, grey levels; > 0.
  double half_contrast = 0;
  /// Standard deviation of the ring's points about their planes, grey levels.
  double ring_sigma = 0;
  /// Share of the ring's points on the wrong side of the threshold.
  double ring_wrong = 0;
  /// Mean side of a module along the columns and the rows, px.
  double module_u_px = 0, module_v_px = 0;
};

/// A cheap look at sixteen points of the rings: whether this can be a marker at all.
bool probe_border(View2D<const u8> image, const QuadMap& map, const Layout& layout);

/// Reads every cell. `spread` is the share of a module's side over which a cell is averaged (0: its centre only).
/// Returns false when there is no border to be seen, or nothing inside it.
bool read_cells(View2D<const u8> image, const QuadMap& map, const Layout& layout, double spread, Reading& reading);

}  // namespace berth
