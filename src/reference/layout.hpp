#pragma once

#include <cstddef>

#include "berth/types.hpp"

/// The packed layouts of kernels/ops.h, read one element at a time.
namespace berth::reference {

/// Byte `x` of a row-major plane of bytes, `stride` bytes a row.
inline int byte_at(const u32* words, int stride, int x, int y) {
  const std::size_t at = static_cast<std::size_t>(y) * static_cast<std::size_t>(stride) + static_cast<std::size_t>(x);
  return static_cast<int>((words[at / 4] >> (8 * (at % 4))) & 255u);
}

/// Bit x of row y of a bit plane, `row_words` words a row.
inline bool bit_at(const u32* bits, int row_words, int x, int y) {
  const std::size_t word =
      static_cast<std::size_t>(y) * static_cast<std::size_t>(row_words) + static_cast<std::size_t>(x / 32);
  return ((bits[word] >> (x % 32)) & 1u) != 0;
}

/// Run ends before bit word `word`, from the two-level offsets of run_count and scan.
inline u32 run_ends_before(const u32* offsets, int base_at, int word) {
  return offsets[word] + offsets[base_at + word / 128];
}

/// Run ends of the rows that fit whole into the capacity.
inline int kept_run_ends(const u32* offsets, int base_at, int height, int row_words, int capacity) {
  u32 kept = 0;
  for (int y = 0; y < height; ++y) {
    const u32 end = run_ends_before(offsets, base_at, (y + 1) * row_words);
    if (end > static_cast<u32>(capacity)) break;
    kept = end;
  }
  return static_cast<int>(kept);
}

}  // namespace berth::reference
