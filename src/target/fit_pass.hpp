#pragma once

#include <array>

#include "berth/image.hpp"
#include "target/edge_profile.hpp"
#include "target/fit_normal.hpp"
#include "target/marker_map.hpp"
#include "target/pattern_cells.hpp"

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

/// One look at all of a marker's pixels, block by block in raster order: the normal equations about a state.
class FitPass {
 public:
  explicit FitPass(Tones tones) : normal(tones) {}

  /// Takes every `row_step`-th row of each block. Returns false where too few pixels count, the map has no end or the
  /// blur is too wide for the modules.
  bool run(const FitScene& scene, const FitState& state, int row_step);
  /// Of residuals that are neighbours in a row and away from all edges: 0 where they are noise or too few, near 1 where
  /// the levels are wrong.
  double correlation() const;

  FitNormal normal;
  MarkerMap map;
  int pixels = 0;

 private:
  int saturated_ = 0, even_ = 0, pairs_ = 0;
  double even_squares_ = 0, pair_products_ = 0;
};

}  // namespace berth
