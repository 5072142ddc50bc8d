#pragma once

#include <vector>

#include "support/pictures.hpp"

namespace berth::test {

/// u8[side, side] of blocks of 11 px in random levels, shifted right and down: corners that a feature detector finds.
inline std::vector<u8> block_picture(u64 seed, int side, int shift = 0) {
  constexpr int kBlock = 11;
  const int across = side / kBlock + 2;
  pictures::Random random(seed);
  std::vector<u8> levels(static_cast<std::size_t>(across * across));
  for (u8& level : levels) level = static_cast<u8>(random.below(256));
  std::vector<u8> pixels;
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const int row = (y - shift + kBlock) / kBlock, column = (x - shift + kBlock) / kBlock;
      pixels.push_back(levels[static_cast<std::size_t>(row * across + column)]);
    }
  }
  return pixels;
}

}  // namespace berth::test
