#pragma once

#include <array>

#include "berth/image.hpp"
#include "target/edge_profile.hpp"
#include "target/lens_blocks.hpp"
#include "target/pattern_cells.hpp"
#include "target/quad_map.hpp"

namespace berth {

/// What a fit starts from and moves.
struct FitState {
  /// Clockwise from the upper left, px.
  Corners corners = {};
  /// Of the marker as it was found, px; they do not move.
  std::array<double, 2> middle = {};
  double side_px = 1;
  /// As in Unknown.
  std::array<double, 3> dark = {};
  std::array<double, 6> contrast = {};
  double tone = 0;
  /// Variance of the blur with the pixel's own square, px²: xx, xy, yy.
  std::array<double, 3> blur = {0.6, 0, 0.6};
  /// Pixels whose residual is beyond are left out, grey levels.
  double most_residual = 128;
};

/// What does not change from pass to pass.
struct FitScene {
  View2D<const u8> image;
  const LensBlocks& lens;
  const EdgeProfile& profile;
  const PatternCells& cells;
  /// Side of the border, modules.
  double border;
};

}  // namespace berth
