#include "svg_panel.hpp"

#include <fmt/format.h>

#include <cmath>

namespace berth::cli {
namespace {

/// A step of 1, 2 or 5 times a power of ten that cuts the span into four to ten.
double tick_step(double span) {
  double power = 1e-9;
  while (power * 10 <= span / 4) power *= 10;
  for (const double factor : {5.0, 2.0}) {
    if (power * factor <= span / 4) return power * factor;
  }
  return power;
}

}  // namespace

std::string svg_escaped(const std::string& text) {
  std::string safe;
  for (const char c : text) {
    if (c == '&') {
      safe += "&amp;";
    } else if (c == '<') {
      safe += "&lt;";
    } else if (c == '>') {
      safe += "&gt;";
    } else {
      safe += c;
    }
  }
  return safe;
}

std::string svg_head(double width, double height, const std::string& title) {
  return fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {0} {1}' width='{0}' height='{1}' "
      "font-family='DejaVu Sans, Helvetica, Arial, sans-serif'>\n"
      "<style>.grid{{stroke:#e3e6ea;stroke-width:1}}.frame{{fill:none;stroke:#555;stroke-width:1}}"
      ".tick{{font-size:11px;fill:#555}}.axis{{font-size:12px;fill:#333}}.panel{{font-size:14px;fill:#111;font-weight:"
      "600}}"
      "</style>\n<rect width='{0}' height='{1}' fill='#fff'/>\n"
      "<text x='56' y='30' font-size='18' font-weight='600' fill='#111'>{2}</text>\n",
      width, height, svg_escaped(title));
}

std::string SvgPanel::across_tick(double at, const std::string& label) const {
  return fmt::format(
      "<path class='grid' d='M{0:.1f} {1:.1f}V{2:.1f}'/><text class='tick' x='{0:.1f}' y='{3:.1f}' "
      "text-anchor='middle'>{4}</text>\n",
      x(at), top_, top_ + side_, top_ + side_ + 16, label);
}

std::string SvgPanel::up_tick(double at, const std::string& label) const {
  return fmt::format(
      "<path class='grid' d='M{0:.1f} {1:.1f}H{2:.1f}'/><text class='tick' x='{3:.1f}' y='{4:.1f}' "
      "text-anchor='end'>{5}</text>\n",
      left_, y(at), left_ + side_, left_ - 6, y(at) + 4, label);
}

std::string SvgPanel::frame(bool ticks_up) const {
  std::string svg;
  const auto each_tick = [](double low, double high, const auto& visit) {
    const double step = tick_step(high - low);
    const int digits = step >= 1 ? 0 : static_cast<int>(std::ceil(-std::log10(step) - 1e-9));
    for (double k = std::ceil(low / step); k * step <= high; ++k) {
      // + 0.0 turns −0 into 0.
      visit(k * step + 0.0, fmt::format("{:.{}f}", k * step + 0.0, digits));
    }
  };
  each_tick(x_low_, x_high_, [&](double at, const std::string& label) { svg += across_tick(at, label); });
  if (ticks_up) each_tick(y_low_, y_high_, [&](double at, const std::string& label) { svg += up_tick(at, label); });
  svg += fmt::format("<rect class='frame' x='{:.1f}' y='{:.1f}' width='{}' height='{}'/>\n", left_, top_, side_, side_);
  svg += fmt::format("<text class='panel' x='{:.1f}' y='{:.1f}'>{}</text>\n", left_, top_ - 8, title_);
  svg += fmt::format("<text class='axis' x='{:.1f}' y='{:.1f}' text-anchor='end'>{}</text>\n", left_ + side_,
                     top_ + side_ + 33, across_);
  svg +=
      fmt::format("<text class='axis' transform='translate({:.1f} {:.1f}) rotate(-90)' text-anchor='end'>{}</text>\n",
                  left_ - 42, top_, up_);
  return svg;
}

std::string svg_polyline(const SvgPanel& panel, const SvgPoints& points, const char* colour, double width,
                         bool closed) {
  if (points.empty()) return "";
  std::string path;
  for (const std::array<double, 2>& p : points) {
    path += fmt::format("{}{:.2f} {:.2f}", path.empty() ? "M" : "L", panel.x(p[0]), panel.y(p[1]));
  }
  return fmt::format(
      "<path d='{}{}' fill='none' stroke='{}' stroke-width='{}' stroke-linejoin='round' stroke-linecap='round'/>\n",
      path, closed ? "Z" : "", colour, width);
}

std::string svg_dot(const SvgPanel& panel, const std::array<double, 2>& at, const char* colour, double radius) {
  return fmt::format("<circle cx='{:.2f}' cy='{:.2f}' r='{}' fill='{}'/>\n", panel.x(at[0]), panel.y(at[1]), radius,
                     colour);
}

}  // namespace berth::cli
