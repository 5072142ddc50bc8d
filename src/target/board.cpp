#include "target/board.hpp"

#include "berth/error.hpp"
#include "target/number_text.hpp"

namespace berth {
namespace {

constexpr int kMostAcross = 100;

bool is_light(int column, int row) { return (column + row) % 2 != 0; }

}  // namespace

double default_pitch_m(const MarkerFamily& family, double marker_m) {
  return marker_m + (family.total_width - family.border_width + 2) * marker_m / family.border_width;
}

const char* name_of(BoardKind kind) {
  return kind == BoardKind::aprilgrid ? "aprilgrid" : kind == BoardKind::chessboard ? "chessboard" : "charuco";
}

void Board::check() const {
  const auto fail = [&](const std::string& problem) { throw Error(describe() + ": " + problem); };
  const int least = kind == BoardKind::aprilgrid ? 2 : 4;
  if (columns < least || rows < least || columns > kMostAcross || rows > kMostAcross) {
    fail("give " + std::to_string(least) + " to " + std::to_string(kMostAcross) + " columns and rows");
  }
  if (!(pitch_m > 0)) fail("the size must be above 0 metres");
  if (kind == BoardKind::chessboard) return;
  const double module = marker_m / family->border_width;
  if (!(marker_m > 0)) fail("the markers' size must be above 0 metres");
  const bool charuco = kind == BoardKind::charuco;
  if (charuco && (family->reversed_border || family->total_width != family->border_width + 2)) {
    fail("this family prints beyond its border, where the dark squares are; use tag36h11 or an aruco family");
  }
  const double least_pitch_m = marker_m + (charuco ? 1 : family->total_width - family->border_width + 1) * module;
  if (pitch_m < least_pitch_m * (1 - 1e-9)) {
    fail("markers of " + shortest_decimal(marker_m) + " m leave too little white within " + shortest_decimal(pitch_m) +
         " m; make them smaller or further apart");
  }
  const std::vector<Marker> all = markers();
  const auto ids = static_cast<int>(family->codes.size());
  if (first_id < 0 || all.back().id >= ids) {
    fail("needs ids " + std::to_string(first_id) + " to " + std::to_string(all.back().id) + ", " + family->name +
         " has 0 to " + std::to_string(ids - 1));
  }
}

std::vector<Board::Marker> Board::markers() const {
  std::vector<Marker> all;
  if (kind == BoardKind::chessboard) return all;
  int id = first_id;
  for (int r = 0; r < rows; ++r) {
    for (int c = 0; c < columns; ++c) {
      if (kind == BoardKind::charuco && !is_light(c, r)) continue;
      all.push_back({id++, {(c + 0.5 - 0.5 * columns) * pitch_m, (r + 0.5 - 0.5 * rows) * pitch_m}});
    }
  }
  return all;
}

std::vector<std::array<double, 2>> Board::points() const {
  std::vector<std::array<double, 2>> all;
  if (kind == BoardKind::aprilgrid) {
    const double h = marker_m / 2;
    for (const Marker& marker : markers()) {
      const double x = marker.center_m[0], y = marker.center_m[1];
      all.insert(all.end(), {{x - h, y - h}, {x - h, y + h}, {x + h, y + h}, {x + h, y - h}});
    }
    return all;
  }
  for (int r = 1; r < rows; ++r) {
    for (int c = 1; c < columns; ++c) all.push_back({(c - 0.5 * columns) * pitch_m, (r - 0.5 * rows) * pitch_m});
  }
  return all;
}

std::vector<Board::Edge> Board::edges() const {
  std::vector<Edge> all;
  if (kind == BoardKind::aprilgrid) {
    for (std::size_t m = 0; m < static_cast<std::size_t>(columns) * static_cast<std::size_t>(rows); ++m) {
      for (std::size_t k = 0; k < 4; ++k) all.push_back({4 * m + k, 4 * m + (k + 1) % 4, k % 2 == 0});
    }
    return all;
  }
  const auto across = static_cast<std::size_t>(columns - 1), down = static_cast<std::size_t>(rows - 1);
  for (std::size_t i = 0; i < across * down; ++i) {
    if (i % across + 1 < across) all.push_back({i, i + 1, false});
    if (i / across + 1 < down) all.push_back({i, i + across, true});
  }
  return all;
}

std::string Board::describe() const {
  const std::string size = std::to_string(columns) + " x " + std::to_string(rows);
  if (kind == BoardKind::chessboard) return "chessboard of " + size + " squares";
  return std::string(name_of(kind)) + " of " + size + (kind == BoardKind::charuco ? " squares, " : " ") + family->name;
}

}  // namespace berth
