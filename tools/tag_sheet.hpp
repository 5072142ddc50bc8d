#pragma once

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

}  // namespace berth::cli
