#pragma once

#include <array>
#include <string>
#include <vector>

#include "berth/marker.hpp"

namespace berth {

enum class BoardKind { aprilgrid, chessboard, charuco };

/// A flat board to calibrate a camera with. Board frame: origin in the middle of the grid, x right, y down, z into the
/// board, metres; like a marker's.
///
/// aprilgrid: columns × rows markers with consecutive ids, row by row from the upper left, as `berth print-tag --grid`
/// prints them; its points are the markers' corners, four each in the order of Detection::corners.
/// chessboard: columns × rows squares, the upper left one dark; its points are the inner corners, row by row.
/// charuco: a chessboard with a marker in every light square, ids row by row from the upper left (OpenCV 4.6 and
/// later); its points are the chessboard's.
struct Board {
  BoardKind kind = BoardKind::aprilgrid;
  int columns = 6, rows = 6;
  /// Side of a square; of an aprilgrid: from one marker to the next.
  double pitch_m = 0;
  /// Side that a marker's corners span; a chessboard has none.
  double marker_m = 0;
  const MarkerFamily* family = nullptr;
  int first_id = 0;

  struct Marker {
    int id;
    std::array<double, 2> center_m;
  };
  /// A straight edge between dark and light that joins two neighbouring points.
  struct Edge {
    std::size_t from, to;
    bool upright;
  };

  /// Throws Error on a board that cannot be: too small, markers that overlap, ids that the family does not have.
  void check() const;
  std::vector<std::array<double, 2>> points() const;
  std::vector<Marker> markers() const;
  std::vector<Edge> edges() const;
  /// What to call it: "aprilgrid of 6 x 6 tag36h11".
  std::string describe() const;
};

/// The space of an aprilgrid where `berth print-tag` was not told another: two light modules between the patterns.
double default_pitch_m(const MarkerFamily& family, double marker_m);

/// "aprilgrid", "chessboard" or "charuco".
const char* name_of(BoardKind kind);

}  // namespace berth
