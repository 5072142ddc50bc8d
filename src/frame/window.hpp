#pragma once

#include <array>

#include "berth/detector.hpp"
#include "frame/marker_plan.hpp"

/// Where a window may lie and what may be believed of it: docs/tracking.md has the reasons.
namespace berth {

/// Windows begin at multiples of this, so that their tiles, and those of the halved image, are the frame's.
constexpr int kWindowStep = 8;
/// Bits of tiles at the window's border are not the frame's, nor are contours through them: px of the whole image.
constexpr int kWindowInset = 2 * kWindowMargin;

/// The rectangle around corners, px.
struct Box {
  double left, top, right, bottom;
};

inline Box box_of(const std::array<std::array<double, 2>, 4>& corners) {
  Box box{corners[0][0], corners[0][1], corners[0][0], corners[0][1]};
  for (const auto& corner : corners) {
    box.left = corner[0] < box.left ? corner[0] : box.left;
    box.right = corner[0] > box.right ? corner[0] : box.right;
    box.top = corner[1] < box.top ? corner[1] : box.top;
    box.bottom = corner[1] > box.bottom ? corner[1] : box.bottom;
  }
  return box;
}

/// How far around a marker outlines may reach that any search takes for it, px: an eighth of a side for corners that
/// pass for the same, a twentieth and 3 px for what a contour may bulge out of its quadrilateral, and some.
inline double window_reach(const Box& box) {
  const double width = box.right - box.left;
  const double height = box.bottom - box.top;
  return 8 + (width > height ? width : height) / 5;
}

/// Whether the window shows all that decides what the frame says of a marker with this box.
inline bool is_well_inside(const Box& box, const SearchWindow& window) {
  const double reach = window_reach(box) + kWindowInset;
  return box.left - reach >= window.x && box.top - reach >= window.y &&
         box.right + reach <= window.x + window.side - 1 && box.bottom + reach <= window.y + window.side - 1;
}

/// Whether the frame says the same of a marker that was found in this window.
inline bool is_frames_own(const Detection& detection, const SearchWindow& window) {
  // A later search may read with fewer wrong bits what this one has some in.
  const bool is_final = !window.full_resolution_only || detection.hamming == 0;
  return is_final && is_well_inside(box_of(detection.corners), window);
}

}  // namespace berth
