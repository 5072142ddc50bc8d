#pragma once

#include <cstddef>

#include "berth/types.hpp"

/// The innermost loops of FrameLevels, compiled for each instruction set.
namespace berth {

/// Pixels of a block: the four tiles of a tile word.
constexpr int kBlockWidth = 16, kBlockHeight = 4;

/// Least and greatest pixel of the four tiles of `count` blocks that begin `step` pixels apart; `scale` 2: of blocks
/// twice as wide and high, halved as the operation halve does. Four bytes a block to `minima` and `maxima`.
void block_extrema(int scale, const u8* pixels, std::ptrdiff_t stride, int count, int step, u8* minima, u8* maxima);

/// How many of the values are `most` or less.
std::size_t count_up_to(const u8* values, std::size_t count, u8 most);

}  // namespace berth
