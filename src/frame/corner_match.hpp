#pragma once

#include <array>
#include <vector>

#include "divide_up.hpp"
#include "frame/window.hpp"
#include "target/quad_map.hpp"

/// Whether two searches have found the same quadrilateral.
namespace berth {

inline double square_distance(const std::array<double, 2>& a, const std::array<double, 2>& b) {
  return (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]);
}

/// Whether every corner of a has one of b's within `tolerance` px and the other way round: a small quadrilateral at a
/// corner of a large one is another.
inline bool same_corners(const Corners& a, const Corners& b, double tolerance) {
  unsigned met = 0;
  for (const auto& corner : a) {
    bool found = false;
    for (std::size_t i = 0; i < b.size(); ++i) {
      if (!(square_distance(corner, b[i]) < tolerance * tolerance)) continue;
      found = true;
      met |= 1U << i;
    }
    if (!found) return false;
  }
  return met == 15;
}

/// Quadrilaterals of one area, listed by where the box around them begins: those that are the same begin within the
/// tolerance, so that a picture full of them is not compared each with each. Allocates nothing once made.
class CornerIndex {
 public:
  CornerIndex() = default;
  /// Of an image of this size; room for `most`.
  CornerIndex(int width, int height, std::size_t most)
      : columns_(divide_up(width, kCell_px)),
        rows_(divide_up(height, kCell_px)),
        first_(static_cast<std::size_t>(columns_) * static_cast<std::size_t>(rows_), kNone) {
    entries_.reserve(most);
  }

  void clear() {
    for (const Entry& entry : entries_) first_[entry.cell] = kNone;
    entries_.clear();
  }

  void add(const Corners& corners) {
    const Box box = box_of(corners);
    const std::size_t cell = cell_of(column(box.left), row(box.top));
    entries_.push_back({corners, cell, first_[cell]});
    first_[cell] = static_cast<int>(entries_.size()) - 1;
  }

  /// Whether it holds these corners, each within `tolerance` px.
  bool has(const Corners& corners, double tolerance) const {
    const Box box = box_of(corners);
    for (int y = row(box.top - tolerance); y <= row(box.top + tolerance); ++y) {
      for (int x = column(box.left - tolerance); x <= column(box.left + tolerance); ++x) {
        for (int i = first_[cell_of(x, y)]; i != kNone; i = entries_[static_cast<std::size_t>(i)].next) {
          if (same_corners(corners, entries_[static_cast<std::size_t>(i)].corners, tolerance)) return true;
        }
      }
    }
    return false;
  }

 private:
  static constexpr int kCell_px = 8;
  static constexpr int kNone = -1;
  struct Entry {
    Corners corners;
    std::size_t cell;
    int next;
  };

  /// Corners may lie outside.
  static int clamped(double at, int cells) {
    return at > 0 ? at < cells * kCell_px ? static_cast<int>(at) / kCell_px : cells - 1 : 0;
  }
  int column(double x) const { return clamped(x, columns_); }
  int row(double y) const { return clamped(y, rows_); }
  std::size_t cell_of(int x, int y) const {
    return static_cast<std::size_t>(y) * static_cast<std::size_t>(columns_) + static_cast<std::size_t>(x);
  }

  int columns_ = 0;
  int rows_ = 0;
  std::vector<int> first_;
  std::vector<Entry> entries_;
};

}  // namespace berth
