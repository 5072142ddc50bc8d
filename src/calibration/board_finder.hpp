#pragma once

#include <memory>
#include <optional>

#include "berth/backend.hpp"
#include "berth/image.hpp"
#include "calibration/board_view.hpp"
#include "target/board.hpp"

namespace berth {

/// Finds a board in images of one size. Markers are found by Berth's detector; a chessboard and the chessboard of a
/// ChArUco by OpenCV.
class BoardFinder {
 public:
  /// Throws Error on a board that cannot be. The backend outlives the finder.
  BoardFinder(const Board& board, Backend& backend, int width, int height);
  ~BoardFinder();

  /// The board as the image shows it; none where too little of it is seen to tell how it lies.
  std::optional<BoardView> find(View2D<const u8> image);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace berth
