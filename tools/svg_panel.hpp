#pragma once

#include <array>
#include <string>
#include <vector>

namespace berth::cli {

/// Text with what means something in SVG escaped.
std::string svg_escaped(const std::string& text);

/// The beginning of a drawing, px: white ground, styles, the title (any text). It ends with "</svg>\n".
std::string svg_head(double width, double height, const std::string& title);

/// A square plot with its place on the page, px; data run right and up, unless flipped.
class SvgPanel {
 public:
  /// Titles are SVG text as they are.
  SvgPanel(double left, double top, double side, std::string title, std::string across, std::string up)
      : left_(left), top_(top), side_(side), title_(std::move(title)), across_(std::move(across)), up_(std::move(up)) {}

  /// What data the edges stand for; 0 to 1 before.
  void fit(double x_low, double x_high, double y_low, double y_high) {
    x_low_ = x_low;
    x_high_ = x_high;
    y_low_ = y_low;
    y_high_ = y_high;
  }
  /// Data grow downwards, as image rows do.
  void flip_up() { down_ = true; }

  double x(double v) const { return left_ + side_ * (v - x_low_) / (x_high_ - x_low_); }
  double y(double v) const {
    const double part = (v - y_low_) / (y_high_ - y_low_);
    return top_ + side_ * (down_ ? part : 1 - part);
  }

  std::string across_tick(double at, const std::string& label) const;
  std::string up_tick(double at, const std::string& label) const;
  /// Frame, title and axis names, with decimal ticks on the axes asked for.
  std::string frame(bool ticks_up) const;

 private:
  double left_, top_, side_;
  std::string title_, across_, up_;
  double x_low_ = 0, x_high_ = 1, y_low_ = 0, y_high_ = 1;
  bool down_ = false;
};

using SvgPoints = std::vector<std::array<double, 2>>;

/// Nothing without points.
std::string svg_polyline(const SvgPanel& panel, const SvgPoints& points, const char* colour, double width,
                         bool closed = false);
std::string svg_dot(const SvgPanel& panel, const std::array<double, 2>& at, const char* colour, double radius);

}  // namespace berth::cli
