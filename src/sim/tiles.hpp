#pragma once

#include <vector>

#include "sim/layer.hpp"
#include "sim/lens.hpp"

namespace berth::sim {

/// Which layers each tile of the image may show, nearest first; what a layer hides in the whole tile is left out.
class Tiles {
 public:
  static constexpr int kSide_px = 8;

  /// `exposures` holds the same layers, farthest first, at each instant of the exposure.
  Tiles(const std::vector<std::vector<Layer>>& exposures, const RayMap& rays);

  const std::vector<int>& layers_at(int x, int y) const {
    return lists_[static_cast<std::size_t>(y / kSide_px) * static_cast<std::size_t>(columns_) +
                  static_cast<std::size_t>(x / kSide_px)];
  }

 private:
  int columns_ = 0;
  std::vector<std::vector<int>> lists_;
};

}  // namespace berth::sim
