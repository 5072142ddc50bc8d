#include "sim/board.hpp"

#include "berth/error.hpp"
#include "sim/printed_marker.hpp"
#include "sim/toml_reader.hpp"

namespace berth::sim {

std::vector<Surface> board_surfaces(const Board& board, double white, double black) {
  const double width = board.columns * board.pitch_m, height = board.rows * board.pitch_m;
  std::vector<Surface> surfaces;
  Surface paper;
  paper.outline = rectangle(width + board.pitch_m, height + board.pitch_m);
  paper.cells = {white};
  paper.fine = true;
  surfaces.push_back(paper);
  if (board.kind != BoardKind::aprilgrid) {
    Surface squares;
    squares.outline = rectangle(width, height);
    squares.columns = board.columns;
    squares.rows = board.rows;
    squares.left = -width / 2;
    squares.top = -height / 2;
    squares.cell_width = squares.cell_height = board.pitch_m;
    squares.cells.clear();
    for (int row = 0; row < board.rows; ++row) {
      for (int column = 0; column < board.columns; ++column) {
        squares.cells.push_back((column + row) % 2 == 0 ? black : white);
      }
    }
    squares.fine = true;
    surfaces.push_back(squares);
  }
  // In a ChArUco the square is the marker's white.
  const double margin = board.kind == BoardKind::charuco ? -1 : 0;
  for (const Board::Marker& marker : board.markers()) {
    surfaces.push_back(pattern_surface(*board.family, board.family->codes.at(static_cast<std::size_t>(marker.id)),
                                       board.marker_m, translation(marker.center_m[0], marker.center_m[1], 0), margin,
                                       white, black));
  }
  return surfaces;
}

std::vector<Surface> read_board(TomlReader reader) {
  Board board;
  const std::string kind = reader.choice("kind", "aprilgrid", {"aprilgrid", "chessboard", "charuco"});
  if (kind == "chessboard") board.kind = BoardKind::chessboard;
  if (kind == "charuco") board.kind = BoardKind::charuco;
  board.columns = reader.integer("columns", 6, 2, 100);
  board.rows = reader.integer("rows", 6, 2, 100);
  const std::string family_name = reader.text("family", board.kind == BoardKind::charuco ? "aruco4x4_50" : "tag36h11");
  try {
    board.family = &berth::family(family_name);
  } catch (const Error& error) {
    reader.fail("family", error.what());
  }
  board.first_id = reader.integer("first_id", 0, 0, 1000000);
  board.marker_m = reader.number("marker_m", 0.03, 0.0005, 10);
  board.pitch_m = reader.number("pitch_m", default_pitch_m(*board.family, board.marker_m), 0.0005, 10);
  const double white = reader.number("white", 0.88, 0, 1), black = reader.number("black", 0.05, 0, 1);
  if (white <= black) reader.fail("white", "make it lighter than black");
  reader.finish();
  try {
    board.check();
  } catch (const Error& error) {
    reader.fail("kind", error.what());
  }
  return board_surfaces(board, white, black);
}

}  // namespace berth::sim
