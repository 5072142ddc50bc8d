#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>

#include "berth/types.hpp"

/// The network's numbers, one at a time (docs/network-arithmetic.md).
namespace berth::reference {

/// Element `at` of s8s packed four to a word, the first in the lowest byte.
inline int s8_at(const u32* words, std::size_t at) {
  const int byte = static_cast<int>((words[at / 4] >> (8 * (at % 4))) & 255u);
  return byte < 128 ? byte : byte - 256;
}

/// Writes element `at`, leaving its neighbours.
inline void set_s8(u32* words, std::size_t at, int value) {
  const u32 shift = static_cast<u32>(8 * (at % 4));
  words[at / 4] = (words[at / 4] & ~(255u << shift)) | (static_cast<u32>(value) & 255u) << shift;
}

/// Index of element (n, y, x, c) in [count, height, width, channels].
inline std::size_t element(int n, int y, int x, int c, int height, int width, int channels) {
  const std::size_t pixel =
      (static_cast<std::size_t>(n) * static_cast<std::size_t>(height) + static_cast<std::size_t>(y)) *
          static_cast<std::size_t>(width) +
      static_cast<std::size_t>(x);
  return pixel * static_cast<std::size_t>(channels) + static_cast<std::size_t>(c);
}

/// floor(a / 2^by).
inline std::int64_t floor_shift(std::int64_t a, int by) {
  const std::int64_t unit = std::int64_t{1} << by;
  return a >= 0 ? a / unit : -((-a + unit - 1) / unit);
}

/// A sum with its bias as an activation: two roundings half up, two clamps; the lower end of the last is the ReLU.
inline int requantized(std::int64_t sum, int multiplier, int shift) {
  const std::int64_t half = shift == 0 ? 0 : std::int64_t{1} << (shift - 1);
  const std::int64_t a = std::clamp<std::int64_t>(floor_shift(sum + half, shift), -32768, 32767);
  return static_cast<int>(std::clamp<std::int64_t>(floor_shift(a * multiplier + (std::int64_t{1} << 21), 22), 0, 127));
}

}  // namespace berth::reference
