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
  /// Pixels further than this from the model are left out, grey levels q4.
  int most_residual = 0;
};

/// What each pixel of a block adds to the fit; products of every two are summed.
enum Channel : int {
  kOne,       // 1
  kLevel,     // P: 0 where the pattern is dark, 1 where it is light, with the tone curve's part, q11
  kTone,      // P (1 - P), q11
  kSlopeU,    // dP/du and
  kSlopeV,    // dP/dv, times the blur's deviation there, q11
  kSpreadU,   // minus dP by the logarithm of the blur's deviation along u
  kSpreadV,   // and v, q11
  kTwist,     // dP by the correlation of the blur's parts along u and v, q11
  kResidual,  // grey levels q4
  kChannels
};

/// Products of two channels, row by row of the upper triangle.
constexpr int kProducts = kChannels * (kChannels + 1) / 2;

/// Pixels told apart.
struct PixelCounts {
  /// Those that count; those among them that see an edge; those left out for being 0 or 255.
  int pixels = 0, on_edges = 0, saturated = 0;
  /// Pixels that count and see no edge; those among them whose left neighbour in the block is another.
  int even = 0, pairs = 0;
  /// Of the even ones' residuals the sum of squares, of pairs the sum of products, q8.
  std::int32_t even_squares = 0, pair_products = 0;
};

/// Sums of a place (a quarter of a block, a block, or four) as they grow: products, then what PixelCounts holds, in its
/// order. Every one is below 2^31 in size: 256 · 2355² are, levels being below 1.15 with the tone curve's part,
/// everything else below 2^11.
struct PlaceSums {
  enum Row : std::size_t {
    kPixels = kProducts,
    kOnEdges,
    kSaturated,
    kEven,
    kPairs,
    kEvenSquares,
    kPairProducts,
    kRows
  };
  static_assert(kRows % 4 == 0, "whole vectors");
  alignas(16) std::array<std::int32_t, kRows> rows;

  void clear() { rows.fill(0); }
  void add(const PixelCounts& counts);
  PixelCounts counts() const;
};

/// A block's pixels, channel by channel, quarter by quarter; what was left out is 0 in every channel.
struct BlockChannels {
  alignas(32) std::array<std::array<std::int16_t, 64>, kChannels> values;
  PixelCounts counts;
};

/// Compares a block with the model. `row_step`: every row, or every second.
void fill_channels(View2D<const u8> image, const PatternCells& cells, const EdgeProfile& profile,
                   const BlockModel& model, int row_step, BlockChannels& channels);

/// Adds the products of pixels [first, first + count): a quarter (16) or all (64).
void add_products(const BlockChannels& channels, int first, int count, PlaceSums& sums);

}  // namespace berth
