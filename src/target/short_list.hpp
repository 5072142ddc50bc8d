#pragma once

#include <array>

#include "target/code_book.hpp"

namespace berth {

/// The few words of a code book that agree best with some levels, best first.
struct ShortList {
  static constexpr int kSize = 8;
  std::array<int, kSize> entry;
  int size = 0;
};

/// Agreement is the sum of the levels, each with the sign of its bit; of equal sums the first in the book comes first.
/// `full_level` is what a sure bit shows. Of large books only the words that differ from the levels' signs in their
/// eight weakest cells, and by the book's max_hamming elsewhere, are looked at.
ShortList likely_words(const CodeBook& book, const std::array<double, kMaxCells>& levels, double full_level);

}  // namespace berth
