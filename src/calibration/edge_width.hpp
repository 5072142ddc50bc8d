#pragma once

#include "berth/image.hpp"
#include "calibration/board_view.hpp"
#include "target/board.hpp"

namespace berth {

/// BoardView::edge_px of the board's edges whose both ends are seen; 0 where there are none.
double edge_width_px(const Board& board, const BoardView& view, View2D<const u8> image);

}  // namespace berth
