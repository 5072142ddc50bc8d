#pragma once

#include <array>
#include <cstddef>
#include <string>
#include <vector>

namespace berth {

/// What one image shows of a board.
struct BoardView {
  /// File or frame, for people.
  std::string label;
  /// Which of Board::points(), and where it was seen, px.
  std::vector<std::size_t> points;
  std::vector<std::array<double, 2>> seen_px;
  /// How wide the edges between dark and light are, px: contrast over steepest slope, the median of the edges of the
  /// worse direction. 2 to 3 in a sharp image.
  double edge_px = 0;
};

}  // namespace berth
