#pragma once

#include <array>
#include <cstdint>

#include "berth/image.hpp"
#include "target/edge_profile.hpp"
#include "target/pattern_cells.hpp"

namespace berth {

/// What the model says of one block of 8 × 8 pixels, rounded to integers. Places are about the block's middle: dx and
/// dy from -4 to 3.
struct BlockModel {
  /// Pixel of dx = dy = 0.
  int x = 0, y = 0;
  /// Marker coordinates, modules q22: coefficients of 1, dx, dy, dx², dx dy, dy².
  std::array<int, 6> u = {}, v = {};
  /// Pixels outside are left out, modules q18.
  int u_first = 0, u_last = 0, v_first = 0, v_last = 0;
  /// Standard deviations of the blur in a module, q8, and modules in kReach of them, q18: along the columns, the rows.
  int per_module_u = 0, per_module_v = 0, reach_u = 0, reach_v = 0;
  /// Correlation of the blur's parts along u and v, and half its square, q12.
  int correlation = 0, half_square = 0;
  /// Of the tone curve: what P (1 - P) adds to the level P, q12.
  int tone = 0;
  /// Grey levels q13 of dark, and from dark to light: coefficients of 1, dx, dy.
  std::array<int, 3> dark = {}, contrast = {};
  /// Pixels further than this from the model are left out, grey levels q5.
  int most_residual = 0;
};

/// What each pixel of a block adds to the fit; products of every two are summed.
enum Channel : int {
  kOne,       // 1
  kLevel,     // P: 0 where the pattern is dark, 1 where it is light, with the tone curve's part, q12
  kTone,      // P (1 - P), q12
  kSlopeU,    // dP/du and
  kSlopeV,    // dP/dv, times the blur's deviation there, q12
  kSpreadU,   // minus dP by the logarithm of the blur's deviation along u
  kSpreadV,   // and v, q12
  kTwist,     // dP by the correlation of the blur's parts along u and v, q12
  kResidual,  // grey levels q5
  kChannels
};

/// Sums over a quarter of a block, 4 × 4 pixels, or a whole one. Every entry is below 2^30 in size: 64 · 2^12 · 2^12.
using ChannelSums = std::array<std::array<std::int32_t, kChannels>, kChannels>;

/// A block's pixels, channel by channel, quarter by quarter; what was left out is 0 in every channel.
struct BlockChannels {
  alignas(32) std::array<std::array<std::int16_t, 64>, kChannels> values;
  /// Pixels that count; those among them that see an edge; those left out for being 0 or 255, and for being too far
  /// off.
  int pixels = 0, on_edges = 0, saturated = 0, outliers = 0;
  /// Pixels that count and see no edge, and the sum of their residuals' squares, q10; those among them whose left
  /// neighbour in the block is another, and the sum of the products of both residuals.
  int even = 0, pairs = 0;
  std::int32_t even_squares = 0, pair_products = 0;
};

/// Compares a block with the model. `row_step`: every row, or every second.
void fill_channels(View2D<const u8> image, const PatternCells& cells, const EdgeProfile& profile,
                   const BlockModel& model, int row_step, BlockChannels& channels);

/// Sums of products over pixels [first, first + count): a quarter (16) or all (64). Upper triangle only.
void sum_products(const BlockChannels& channels, int first, int count, ChannelSums& sums);

}  // namespace berth
