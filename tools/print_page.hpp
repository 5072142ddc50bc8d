#pragma once

#include <string>
#include <vector>

namespace berth::cli {

/// A page to print at true size, as SVG or PDF, black on white. Millimetres from the upper left, x right, y down.
class PrintPage {
 public:
  struct Rectangle {
    double x, y, width, height;
  };

  PrintPage(double width_mm, double height_mm) : width_(width_mm), height_(height_mm) {}

  void rectangle(double x, double y, double width, double height) { rectangles_.push_back({x, y, width, height}); }
  /// A disc about (x, y), light where it is the hole of a ring; later ones cover earlier ones.
  void disc(double x, double y, double radius, bool light = false) { discs_.push_back({x, y, radius, light}); }
  void line(double x0, double y0, double x1, double y1, double width = 0.2) {
    lines_.push_back({x0, y0, x1, y1, width});
  }
  /// Plain ASCII, its base line's left end at (x, y).
  void text(double x, double y, double height, const std::string& words) { texts_.push_back({x, y, height, words}); }

  const std::vector<Rectangle>& rectangles() const { return rectangles_; }
  std::string svg() const;
  std::string pdf() const;

 private:
  struct Line {
    double x0, y0, x1, y1, width;
  };
  struct Text {
    double x, y, height;
    std::string words;
  };

  struct Disc {
    double x, y, radius;
    bool light;
  };

  double width_, height_;
  std::vector<Rectangle> rectangles_;
  std::vector<Disc> discs_;
  std::vector<Line> lines_;
  std::vector<Text> texts_;
};

}  // namespace berth::cli
