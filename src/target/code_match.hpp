#pragma once

#include "target/code_book.hpp"
#include "target/reading.hpp"

namespace berth {

/// A code found in a reading, and how well the reading looks like that code.
struct CodeMatch {
  /// 4 · id + quarter turns; -1 for none.
  int entry = -1;
  /// Bits whose sign differs from the code's.
  int hamming = 0;
  /// Squared correlation of the reading with the code as the lens would blur it: 1 is perfect.
  double likeness = 0;
};

/// A code book with the likeness that a code must have before it is believed.
class CodeMatcher {
 public:
  CodeMatcher(const MarkerFamily& family, const Layout& layout, int max_hamming);

  const CodeBook& book() const { return book_; }

  /// The code whose bits the reading shows, with no more wrong bits than allowed.
  CodeMatch match_bits(const Layout& layout, const Reading& reading) const;

  /// The code that explains the grey levels best, if it explains them far better than any other: each bit counts by how
  /// far it is from the threshold, so a code may be found although many bits are on the wrong side by a little.
  CodeMatch match_levels(const Layout& layout, const Reading& reading) const;

 private:
  CodeBook book_;
  double bits_likeness_;
  double levels_likeness_;
  double least_evidence_;
  int correctable_;
  bool levels_allowed_;
};

}  // namespace berth
