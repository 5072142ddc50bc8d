#pragma once

#include <array>
#include <cstddef>

#include "berth/marker.hpp"

namespace berth {

/// A module with its eight neighbours, as three rows of changes from left to right: what a pixel in it can see.
struct PatternCell {
  enum Kind : signed char { kUnknown, kEven, kEdges };
  /// Whether something here is not known, or all nine are alike.
  Kind kind = kUnknown;
  /// Of each row: 1 where its left module is light; what the middle one adds to that; what the right one adds.
  std::array<signed char, 3> left = {}, middle = {}, right = {};
};

/// The four modules about every crossing of module lines, as planes of bytes:
/// P = even + by_u e + by_v f + both e f between edges e and f, -1 before and 1 after them, all in 1/32.
struct PatternNodes {
  static constexpr int kWidth = 22;  // kMost modules, and two lines more on either side
  using Plane = std::array<signed char, kWidth * kWidth>;
  Plane even, by_u, by_v, both;
  Plane known;  // -1 where all four are, else 0
};

/// The printed pattern of one marker: border, light ring and data. What a family leaves open (the middle of
/// tagCustom48h12, the corners of round families) is unknown; outside, the outermost modules go on.
class PatternCells {
 public:
  /// Widest pattern of any family, modules.
  static constexpr int kMost = 16;

  void set(const MarkerFamily& family, int id);
  /// First and last column and row of the pattern, in modules from the border's upper left.
  int first() const { return first_; }
  int last() const { return first_ + width_ - 1; }
  /// Line `column` is before module `column`. The index of a node in its planes: first() - 2 … last() + 3 each.
  std::size_t node(int column, int row) const {
    return static_cast<std::size_t>((row - first_ + 2) * PatternNodes::kWidth + column - first_ + 2);
  }
  const PatternNodes& nodes() const { return nodes_; }
  /// The cell at (column, row), first() … last() each.
  const PatternCell& at(int column, int row) const {
    return cells_[static_cast<std::size_t>((row - first_) * kMost + column - first_)];
  }

 private:
  int first_ = 0, width_ = 0;
  std::array<PatternCell, kMost * kMost> cells_;
  PatternNodes nodes_;
};

}  // namespace berth
