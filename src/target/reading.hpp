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
  /// Mean side of a module along the columns and the rows, px.
  double module_u_px = 0, module_v_px = 0;
  /// Area of a module at the border's corner where it is least, px².
  double module_area_px2 = 0;
};

/// What there is at a quadrilateral: no border, a border around an even area, or cells.
enum class Seen { no_border, nothing, cells };

/// A cheap look at sixteen points of the rings: light less dark, grey levels, or 0 where this cannot be a marker.
double probe_border(View2D<const u8> image, const QuadMap& map, const Layout& layout);

/// Whether the cells' centres are as good as equal beside the border's contrast (a plain square), whatever the shading.
bool are_cells_even(View2D<const u8> image, const QuadMap& map, const Layout& layout, double contrast);

/// Reads every cell within a border whose shading is known. `spread` is the share of a module's side over which a cell
/// is averaged (0: its centre only).
Seen read_cells(View2D<const u8> image, const QuadMap& map, const Layout& layout, const PlaneShading& shading,
                double spread, Reading& reading);
Seen read_cells(View2D<const u8> image, const QuadMap& map, const Layout& layout, const EdgeShading& shading,
                double spread, Reading& reading);

}  // namespace berth
