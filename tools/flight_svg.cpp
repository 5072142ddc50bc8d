#include "flight_svg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "svg_panel.hpp"

namespace berth::cli {
namespace {

constexpr double kLeft = 64, kTop = 56, kWidth = 860, kHeight = 380, kBottom = 44;
constexpr double kNearest_m = 0.1, kFurthest_m = 10;

const char* colour_of(Mode mode) {
  switch (mode) {
    case Mode::search:
      return "#f3d9d5";
    case Mode::navigation:
      return "#dce8f5";
    default:
      return "#dff0dc";
  }
}

class Plot {
 public:
  explicit Plot(const FlightLog& log) : log_(log), last_(std::max<std::size_t>(2, log.points.size()) - 1) {}

  std::string text() const {
    const std::string svg =
        svg_head(kLeft + kWidth + 24, kTop + kHeight + kBottom, fmt::format("Flight {}: {}", log_.seed, log_.title)) +
        "<g font-size='12'>\n";
    return svg + bands() + axes() + truth() + dots() + legend() + "</g></svg>\n";
  }

 private:
  double x(double frame) const { return kLeft + kWidth * frame / static_cast<double>(last_); }
  static double y(double range_m) {
    const double held = std::clamp(range_m, kNearest_m, kFurthest_m);
    return kTop + kHeight * (1 - std::log(held / kNearest_m) / std::log(kFurthest_m / kNearest_m));
  }

  std::string bands() const {
    std::string svg;
    for (std::size_t from = 0; from < log_.points.size();) {
      std::size_t to = from;
      while (to < log_.points.size() && log_.points[to].mode == log_.points[from].mode) ++to;
      const FlightPoint& first = log_.points[from];
      svg += fmt::format("<rect x='{:.1f}' y='{}' width='{:.1f}' height='{}' fill='{}'/>\n", x(first.frame), kTop,
                         x(static_cast<double>(std::min(to, last_))) - x(first.frame), kHeight, colour_of(first.mode));
      // Upright, along the change.
      const std::string words =
          first.change.empty() ? name_of(first.mode) : fmt::format("{}: {}", name_of(first.mode), first.change);
      svg += fmt::format("<text transform='translate({:.1f} {}) rotate(90)' fill='#555'>{}</text>\n",
                         x(first.frame) + 4, kTop + 6, words);
      from = to;
    }
    return svg;
  }

  std::string axes() const {
    std::string svg;
    for (const double range : {0.1, 0.2, 0.5, 1.0, 1.5, 2.0, 5.0, 10.0}) {
      svg += fmt::format(
          "<path d='M{0} {1:.1f}H{2}' stroke='#bbb' stroke-width='.5'/><text x='{3}' y='{4:.1f}' text-anchor='end'>{5} "
          "m</text>\n",
          kLeft, y(range), kLeft + kWidth, kLeft - 6, y(range) + 4, range);
    }
    const int step = std::max(1, static_cast<int>(last_) / 100 * 10);
    for (int frame = 0; frame <= static_cast<int>(last_); frame += step) {
      svg +=
          fmt::format("<text x='{:.1f}' y='{}' text-anchor='middle'>{}</text>\n", x(frame), kTop + kHeight + 18, frame);
    }
    return svg + fmt::format("<text x='{}' y='{}' text-anchor='middle'>frame</text>\n", kLeft + kWidth / 2,
                             kTop + kHeight + 36);
  }

  std::string truth() const {
    std::string path;
    for (const FlightPoint& point : log_.points) {
      path += fmt::format("{}{:.1f} {:.1f}", path.empty() ? "M" : "L", x(point.frame), y(point.true_range_m));
    }
    return fmt::format("<path d='{}' fill='none' stroke='#444' stroke-width='1.2'/>\n", path);
  }

  std::string dots() const {
    std::string svg;
    for (const FlightPoint& point : log_.points) {
      if (!point.has_position) continue;
      const char* colour = point.wrong() ? "#c8102e" : point.from_marker ? "#2a8a2a" : "#2060c0";
      if (!point.from_marker) {
        svg +=
            fmt::format("<path d='M{0:.1f} {1:.1f}V{2:.1f}' stroke='{3}' stroke-opacity='.3'/>\n", x(point.frame),
                        y(point.range_m - point.range_deviation_m), y(point.range_m + point.range_deviation_m), colour);
      }
      svg +=
          fmt::format("<circle cx='{:.1f}' cy='{:.1f}' r='2' fill='{}'/>\n", x(point.frame), y(point.range_m), colour);
    }
    return svg;
  }

  std::string legend() const {
    std::string svg;
    double at = kLeft;
    for (const auto& [colour, words] :
         {std::pair<const char*, const char*>{"#444", "true range to the target's centre"},
          {"#2060c0", "network"},
          {"#2a8a2a", "marker"},
          {"#c8102e", "something else taken for the target"}}) {
      svg += fmt::format("<circle cx='{}' cy='42' r='4' fill='{}'/><text x='{}' y='46'>{}</text>\n", at + 4, colour,
                         at + 12, words);
      at += 36 + 6.5 * static_cast<double>(std::string(words).size());
    }
    return svg;
  }

  const FlightLog& log_;
  std::size_t last_;
};

}  // namespace

std::string flight_svg(const FlightLog& log) { return Plot(log).text(); }

}  // namespace berth::cli
