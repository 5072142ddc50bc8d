#pragma once

#include <array>

#include "target/block_group.hpp"
#include "target/fit_scene.hpp"
#include "target/marker_map.hpp"
#include "target/node_block.hpp"
#include "target/pattern_sums.hpp"

namespace berth {

/// The blur as the marker's axes see it at one place: deviations in modules, and their correlation.
struct AxesBlur {
  /// `s`: variances in the image; `u` and `v`: the marker coordinates there, of which the slopes count.
  AxesBlur(const std::array<double, 3>& s, const Quadratic& u, const Quadratic& v);

  // Variances' derivatives by those in the image, and the covariance's.
  std::array<double, 3> by_u, by_v;
  double var_u, var_v, dev_u, dev_v;
  std::array<double, 3> by_uv;
  double correlation;
};

/// What a state says of blocks of pixels, rounded to integers.
class BlockModels {
 public:
  BlockModels(const FitScene& scene, const FitState& state, const MarkerMap& map);

  /// Blocks that the pattern may touch: columns and rows, both ends included.
  struct Range {
    int left, right, top, bottom;
  };
  Range range() const;
  /// Fills a group that has its columns and rows.
  void fill(BlockGroup& group) const { fill_group(scene_.lens, source_, group); }

  double contrast(double x, double y) const;
  double x_of(double px) const { return (px - state_.middle[0]) * per_side_; }
  double y_of(double px) const { return (px - state_.middle[1]) * per_side_; }

  /// In full, for every block.
  BlockModel model(const BlockGroup& group, std::size_t lane, const AxesBlur& blur) const;
  /// By the nearest nodes alone: what is the same for all blocks of a place, then a block of it. False where nodes are
  /// not enough.
  bool set_place(const AxesBlur& blur, NodePlace& place);
  bool set_block(const BlockGroup& group, std::size_t lane, NodeBlock& block) const;

 private:
  struct Limits {
    double first, last;
  };
  double last() const { return scene_.border - first_; }
  Limits limits(double deviation) const;

  const FitScene& scene_;
  const FitState& state_;
  const MarkerMap& map_;
  double first_, per_side_;
  GroupSource source_;
  Limits limits_u_ = {}, limits_v_ = {};
};

}  // namespace berth
