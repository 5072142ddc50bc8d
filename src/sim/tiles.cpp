#include "sim/tiles.hpp"

#include <algorithm>

namespace berth::sim {
namespace {

struct Box {
  Vec2 low, high;
};

// All rays of the pixels [x0, x1) × [y0, y1): the map is one-to-one, so those of the rim enclose the others.
Box ray_box(const RayMap& rays, int x0, int y0, int x1, int y1) {
  Box box{rays.corner(x0, y0), rays.corner(x0, y0)};
  const auto include = [&](const Vec2& ray) {
    for (std::size_t i = 0; i < 2; ++i) {
      box.low[i] = std::min(box.low[i], ray[i]);
      box.high[i] = std::max(box.high[i], ray[i]);
    }
  };
  for (int x = x0; x <= x1; ++x) {
    include(rays.corner(x, y0));
    include(rays.corner(x, y1));
  }
  for (int y = y0; y <= y1; ++y) {
    include(rays.corner(x0, y));
    include(rays.corner(x1, y));
  }
  return box;
}

enum class Cover { none, part, full };

Cover cover(const Layer& layer, const Box& box) {
  if (!layer.visible() || layer.low()[0] > box.high[0] || layer.high()[0] < box.low[0] ||
      layer.low()[1] > box.high[1] || layer.high()[1] < box.low[1]) {
    return Cover::none;
  }
  bool full = !layer.disc();
  for (int i = 0; i < layer.sides(); ++i) {
    const Vec3& line = layer.side(i);
    const double x_low = line[0] * box.low[0], x_high = line[0] * box.high[0];
    const double y_low = line[1] * box.low[1], y_high = line[1] * box.high[1];
    if (std::max(x_low, x_high) + std::max(y_low, y_high) + line[2] < 0) return Cover::none;
    if (std::min(x_low, x_high) + std::min(y_low, y_high) + line[2] <= 0) full = false;
  }
  return full ? Cover::full : Cover::part;
}

}  // namespace

Tiles::Tiles(const std::vector<std::vector<Layer>>& exposures, const RayMap& rays) {
  const int width = rays.camera().width, height = rays.camera().height;
  columns_ = (width + kSide_px - 1) / kSide_px;
  const int rows = (height + kSide_px - 1) / kSide_px;
  lists_.resize(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows));
  for (int row = 0; row < rows; ++row) {
    for (int column = 0; column < columns_; ++column) {
      const Box box = ray_box(rays, column * kSide_px, row * kSide_px, std::min(width, (column + 1) * kSide_px),
                              std::min(height, (row + 1) * kSide_px));
      std::vector<int>& list =
          lists_[static_cast<std::size_t>(row) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(column)];
      for (int i = static_cast<int>(exposures[0].size()) - 1; i >= 0; --i) {
        bool some = false, full = true;
        for (const std::vector<Layer>& layers : exposures) {
          const Cover c = cover(layers[static_cast<std::size_t>(i)], box);
          some = some || c != Cover::none;
          full = full && c == Cover::full;
        }
        if (some) list.push_back(i);
        if (full) break;
      }
    }
  }
}

}  // namespace berth::sim
