#pragma once

#include "berth/bundle.hpp"
#include "berth/marker.hpp"
#include "print_page.hpp"

namespace berth::cli {

/// Markers to print: a grid of consecutive ids, row by row from the upper left.
struct TagSheet {
  const MarkerFamily* family = nullptr;
  int first_id = 0;
  int columns = 1, rows = 1;
  double side_mm = 0;  ///< of the square that the corners span
  double gap_mm = 0;   ///< between neighbouring squares; 0 for two modules between what is printed of them
  double width_mm = 210, height_mm = 297;

  double module_mm() const { return side_mm / family->border_width; }
  double pitch_mm() const;
  /// From the first marker's printed edge to the last one's, with a module of white around.
  double across_mm() const;
  double down_mm() const;
};

/// The sheet in the middle of its page: cutting lines, the measured side, the marker's axes, a ruler of 100 mm to check
/// the printer by. Throws Error where the page is too small, neighbours would overlap, or the family has too few ids.
PrintPage draw_sheet(const TagSheet& sheet);

/// A bundle's markers in their places on a page of that size, upright as the first of them is, with the same aids.
/// Throws Error unless they lie in one plane, face one way, are turned by quarters against each other, and fit: into
/// the page, and beside each other or into the free middle of a larger one.
PrintPage draw_bundle(const Bundle& bundle, double width_mm, double height_mm);

}  // namespace berth::cli
