#pragma once

#include <array>
#include <vector>

#include "berth/image.hpp"
#include "frame/marker_plan.hpp"

namespace berth {

/// The levels that the docking plan measures on the device (tile_extrema, tile_histogram, normalize), from the frame on
/// the host: only the eighth of the pixels that these count is read. Where windows are searched, this is all that is
/// looked at of the rest of the frame, and it makes a window's thresholds the frame's own.
class FrameLevels {
 public:
  using Words = std::array<u32, 4>;

  /// The geometries of the whole and the halved image; `gains` as pack_gains made them, or empty.
  FrameLevels(const MarkerGeometry& whole, const MarkerGeometry& half, std::vector<u32> gains);

  /// Of the whole image, and where `scales` is 2 of the halved one too.
  void measure(View2D<const u8> image, std::size_t scales = 2);
  /// As normalize writes them for the whole (0) or the halved image (1), with the asked contrast alone: the rest are 0,
  /// and no operation reads them.
  const Words& levels(std::size_t scale) const { return levels_[scale]; }
  /// The gains from that pixel on, q12.
  const void* gains_at(int x, int y) const {
    const std::size_t stride = static_cast<std::size_t>(whole_.padded_width);
    return reinterpret_cast<const u8*>(gains_.data()) +
           2 * (static_cast<std::size_t>(y) * stride + static_cast<std::size_t>(x));
  }

 private:
  void collect(View2D<const u8> image, const MarkerGeometry& geometry, int scale);
  void copy_block(View2D<const u8> image, int x0, int y0, int side_x, int side_y, u8* block) const;

  MarkerGeometry whole_, half_;
  std::vector<u32> gains_;
  std::vector<u8> minima_, maxima_, ranges_;  // of the tiles that are counted
  std::array<Words, 2> levels_ = {};
};

}  // namespace berth
