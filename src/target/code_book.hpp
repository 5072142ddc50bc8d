#pragma once

#include <vector>

#include "berth/marker.hpp"
#include "target/layout.hpp"

namespace berth {

/// A family's codes in every rotation, as words whose bit i is the layout's cell i.
class CodeBook {
 public:
  /// A word as it was found among the codes: entry = 4 · id + quarter turns (clockwise) of the marker.
  struct Match {
    int entry = -1;
    int hamming = 0;
  };

  /// Words with up to `max_hamming` wrong bits are found.
  CodeBook(const MarkerFamily& family, const Layout& layout, int max_hamming);

  const MarkerFamily& family() const { return *family_; }
  int max_hamming() const { return max_hamming_; }
  int bits() const { return bits_; }
  const std::vector<u64>& words() const { return words_; }

  /// The nearest code within max_hamming, the first in the table of equally near ones; entry -1 if there is none.
  Match find(u64 word) const;
  void list_constants(std::vector<ConstantMemory>& to) const;

 private:
  struct Chunk {
    int shift = 0;
    u64 mask = 0;
    std::vector<u32> first;    // [mask + 2]: where in `entries` each value of the chunk starts
    std::vector<u32> entries;  // every entry, ordered by its chunk
  };

  const MarkerFamily* family_;
  int bits_;
  int max_hamming_;
  std::vector<u64> words_;
  std::vector<Chunk> chunks_;
};

/// Number of set bits; needs no instruction beyond the baseline.
inline int count_bits(u64 v) {
  v -= (v >> 1) & 0x5555555555555555u;
  v = (v & 0x3333333333333333u) + ((v >> 2) & 0x3333333333333333u);
  v = (v + (v >> 4)) & 0x0f0f0f0f0f0f0f0fu;
  return static_cast<int>((v * 0x0101010101010101u) >> 56);
}

}  // namespace berth
