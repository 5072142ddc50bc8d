#pragma once

#include <string>
#include <vector>

#include "calibration/board_view.hpp"

namespace berth {

/// The views for a calibration as they gather, and how much of the image they cover.
class ViewSet {
 public:
  static constexpr int kAcross = 8, kDown = 6;

  enum class Verdict { taken, blurred, repeated, full };

  /// For images of one size, px; more than `most` views are not taken.
  ViewSet(int width, int height, std::size_t most);

  /// Takes the view unless it is blurred, or shows the board where an earlier one did.
  Verdict add(BoardView view);

  const std::vector<BoardView>& views() const { return views_; }
  int width() const { return width_; }
  int height() const { return height_; }
  /// Points in each field of a grid over the image, row-major [kDown, kAcross].
  const std::vector<int>& fields() const { return fields_; }
  /// Share of the fields with points, 0 … 1.
  double coverage() const;
  int blurred() const { return blurred_; }

  /// Why the views cannot calibrate a camera, with what to do; empty when they may.
  std::vector<std::string> objections() const;

 private:
  bool is_repeated(const BoardView& view) const;
  std::string empty_parts() const;

  int width_, height_;
  std::size_t most_;
  std::vector<BoardView> views_;
  std::vector<int> fields_;
  int blurred_ = 0;
};

}  // namespace berth
