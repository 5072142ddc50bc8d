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
  /// The cell at (column, row), first() … last() each.
  const PatternCell& at(int column, int row) const {
    return cells_[static_cast<std::size_t>((row - first_) * kMost + column - first_)];
  }

 private:
  int first_ = 0, width_ = 0;
  std::array<PatternCell, kMost * kMost> cells_;
};

}  // namespace berth
