#pragma once

#include "target/fit_normal.hpp"
#include "target/fit_scene.hpp"
#include "target/marker_map.hpp"
#include "target/pattern_sums.hpp"

namespace berth {

/// One look at all of a marker's pixels, block by block in raster order: the normal equations about a state.
class FitPass {
 public:
  explicit FitPass(Tones tones) : normal(tones), tones_(tones) {}

  /// Which pixels a pass takes: a quarter of them, all over the marker, for a step that need not be exact.
  enum class Share { all, quarter };

  /// `map`: by the state's corners. Returns false where too few pixels count, the map bends too much or the blur is too
  /// wide for the modules.
  bool run(const FitScene& scene, const MarkerMap& map, const FitState& state, Share share);
  /// Of residuals that are neighbours in a row and away from all edges: 0 where they are noise or too few, near 1 where
  /// the levels are wrong.
  double correlation() const;
  /// How many times the corners' covariance is that of independent residuals: what the model leaves is correlated, and
  /// more of it where the edges are (docs/corners.md).
  double excess(double side_px) const;

  FitNormal normal;
  int pixels = 0;

 private:
  class Places;
  void count(const PixelCounts& counts);

  Tones tones_;
  int saturated_ = 0, even_ = 0, pairs_ = 0;
  double even_squares_ = 0, pair_products_ = 0;
};

}  // namespace berth
