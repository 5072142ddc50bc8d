#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "target/lens_blocks.hpp"
#include "target/node_block.hpp"

namespace berth {

/// Up to four blocks of LensBlocks at once, a lane each: where they lie on the marker and what the model says there.
struct BlockGroup {
  static constexpr std::size_t kMost = NodeBlocks::kMost;
  template <class T>
  using Lanes = std::array<T, kMost>;

  /// A marker coordinate.
  struct Coordinate {
    /// Coefficients of 1, dx, dy, dx², dx dy, dy², modules.
    alignas(32) std::array<Lanes<double>, 6> q;
    /// Between these is all of the block.
    alignas(32) Lanes<double> low, high;
    /// The first node that a pixel of the block is nearest to, and what NodeCoordinate has from there.
    alignas(16) Lanes<std::int32_t> first, start;
    alignas(16) std::array<Lanes<std::int32_t>, 5> slopes;

    Quadratic at(std::size_t lane) const {
      return {q[0][lane], q[1][lane], q[2][lane], q[3][lane], q[4][lane], q[5][lane]};
    }
  };

  void clear() { count = 0; }
  void add(int column, int row) {
    columns[count] = column;
    rows[count++] = row;
  }

  std::size_t count = 0;
  Lanes<int> columns, rows;
  Coordinate u, v;
  /// Grey levels q9 in the middle, and by which contrast grows per pixel: NodeBlock.
  alignas(16) Lanes<std::int32_t> dark, contrast, contrast_x, contrast_y;
  /// Bit by lane: no pixel is on the pattern; the coordinates bend too much for quadratics; a NodeBlock has room for
  /// it.
  unsigned outside = 0, bent = 0, fits = 0;
};

/// What a group is filled from.
struct GroupSource {
  /// From the lens' plane: rows of u z, v z and z.
  std::array<std::array<double, 3>, 3> back;
  /// Where the pattern begins and ends, modules.
  double first, last;
  /// Grey levels: FitState. Of an image coordinate `px`, X or Y is (px - middle) · per_side.
  std::array<double, 3> dark;
  std::array<double, 6> contrast;
  std::array<double, 2> middle;
  double per_side;
};

/// Fills a group that has its columns and rows: each lane by the same operations on every instruction set.
void fill_group(const LensBlocks& lens, const GroupSource& source, BlockGroup& group);

}  // namespace berth
