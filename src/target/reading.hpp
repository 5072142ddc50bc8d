#pragma once

#include <array>

#include "berth/image.hpp"
#include "target/layout.hpp"
#include "target/quad_map.hpp"
#include "target/shading.hpp"

namespace berth {

/// What the image shows at the cells of a layout.
struct Reading {
  /// Grey level of each cell minus its threshold (the mean of light and dark there), scaled as if the contrast were the
  /// same everywhere. Cells outside the image read 0.
  std::array<double, kMaxCells> value;
  /// Half the difference between light and dark, grey levels; > 0.
  double half_contrast = 0;
  /// How far the rings are from their planes, relative to half_contrast; 0 for Shade::edges.
  double misfit = 0;
  /// Mean side of a module along the columns and the rows, px.
  double module_u_px = 0, module_v_px = 0;
  /// Area of a module at the border's corner where it is least, px².
  double module_area_px2 = 0;
};

/// Where a reading's thresholds come from: PlaneShading or EdgeShading.
enum class Shade { planes, edges };

/// What there is at a quadrilateral: no border, a border around an even area, or cells.
enum class Seen { no_border, nothing, cells };

/// A cheap look at sixteen points of the rings: whether this can be a marker at all.
bool probe_border(View2D<const u8> image, const QuadMap& map, const Layout& layout);

/// Reads every cell. `spread` is the share of a module's side over which a cell is averaged (0: its centre only).
Seen read_cells(View2D<const u8> image, const QuadMap& map, const Layout& layout, Shade shade, double spread,
                Reading& reading);

}  // namespace berth
