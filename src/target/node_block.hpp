#pragma once

#include <array>
#include <cstdint>

#include "berth/image.hpp"
#include "target/edge_profile.hpp"
#include "target/pattern_sums.hpp"

namespace berth {

/// What the model says alike of all blocks of a place whose modules are wide against the blur, so that a pixel sees
/// one edge along each axis at most, those of the nearest node: in 16 bits, up to 32 pixels a vector.
struct NodePlace {
  /// Rows -4, -4 + row_step, … of a block are taken: 1 or 2.
  int row_step = 1;
  /// An eighth of the blur's deviations in a module, as gain · 2^doublings, q15.
  std::int16_t gain_u = 0, gain_v = 0;
  int doublings_u = 0, doublings_v = 0;
  /// Correlation of the blur's parts along u and v, half its square, the tone curve's bend: q15.
  std::int16_t correlation = 0, half_square = 0, tone = 0;
  /// Pixels further than this from the model are left out, grey levels q4.
  std::int16_t most_residual = 0;
};

/// Modules q16 from half a module before a block's first node: coefficients of 1; dx, dy, dx², dx dy, dy². In every
/// column what dy is multiplied by, dy's and dx dy's together, is below 2^15, too.
struct NodeCoordinate {
  std::int32_t start = 0;
  std::array<std::int16_t, 5> slopes = {};
};

/// What it says of one of the blocks of 8 × 8 pixels. Pixels are about the block's middle, dx and dy from -4 to 3.
struct NodeBlock {
  /// Pixel of dx = dy = 0; all 64 lie in the image.
  int x = 0, y = 0;
  /// From 0 to below 4 modules at every pixel.
  NodeCoordinate u, v;
  /// Pixels outside are left out, the same scale; `whole` says that none is.
  std::int32_t u_first = 0, u_last = 0, v_first = 0, v_last = 0;
  bool whole = true;
  /// PatternNodes' bytes of 4 × 4 nodes, row by row.
  struct Nodes {
    alignas(16) std::array<std::int8_t, 16> even, by_u, by_v, both, known;
  } nodes;
  bool all_known = true;
  /// Grey levels of dark, and from dark to light: q9 in the middle, and by which they grow per pixel to the right and
  /// down. |dark| < 1000, every |step| < 7.8, |contrast| < 511 at every pixel.
  std::int32_t dark = 0, contrast = 0;
  std::array<std::int16_t, 2> dark_step = {}, contrast_step = {};
};

/// Blocks of a place, and what is common to them.
struct NodeBlocks {
  static constexpr std::size_t kMost = 4;
  NodePlace place;
  std::array<NodeBlock, kMost> blocks;
  std::size_t count = 0;
};

/// Adds blocks to their place's sums. The same integers on every instruction set, and as `reference::add_block`.
void add_blocks(View2D<const u8> image, const EdgePieces& edge, const NodeBlocks& blocks, PlaceSums& sums);

namespace reference {

/// The definition, pixel by pixel.
void add_block(View2D<const u8> image, const EdgePieces& edge, const NodePlace& place, const NodeBlock& block,
               PlaceSums& sums);

}  // namespace reference
}  // namespace berth
