#pragma once

#include <vector>

#include "berth/detector.hpp"
#include "frame/window.hpp"

namespace berth {

/// Puts windows of fixed sides around boxes.
class Placement {
 public:
  /// `sides` ascending; `most_windows` of each.
  Placement(int width, int height, std::vector<int> sides, int most_windows);

  enum class Outcome { placed, border, large };
  /// Around each box, grown by what a window needs around it; neighbours share one where that is no larger than two.
  /// No more than `most_pixels` in all.
  Outcome place(std::vector<Box>& boxes, double most_pixels, std::vector<SearchWindow>& windows) const;

  /// A box with what a window must show around it.
  static Box with_reach(const Box& box);

 private:
  /// The least side that takes a box wherever multiples of kWindowStep are; 0 where none does.
  int side_for(const Box& box) const;
  bool put(const Box& box, int side, SearchWindow& window) const;
  /// Joins the two boxes that cost the least pixels more together; false where no two fit a window.
  bool join(std::vector<Box>& boxes, bool only_savings) const;

  int width_, height_;
  std::vector<int> sides_;
  std::size_t most_windows_;
};

}  // namespace berth
