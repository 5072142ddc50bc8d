#include "roc_svg.hpp"

#include <fmt/format.h>

#include <iterator>

#include "svg_panel.hpp"

namespace berth::cli {
namespace {

constexpr double kWidth = 600, kLeft = 72, kTop = 76, kSide = 480;
constexpr double kLegend = kTop + kSide + 56, kLine = 20;  // below the plot, where it hides nothing
constexpr const char* kNetworkColour = "#c8102e";
constexpr const char* kOtherColours[] = {"#1f4e8c", "#8a8f98", "#7a5c00"};

const char* colour_of(std::size_t other) { return kOtherColours[other % std::size(kOtherColours)]; }

using Place = std::optional<std::array<double, 2>>;

Place rates(const Decisions& d) { return {{d.false_positive_rate(), d.true_positive_rate()}}; }
/// None where nothing is found.
Place precision_at(const Decisions& d) {
  return d.found() > 0 ? Place{{d.true_positive_rate(), d.precision()}} : std::nullopt;
}

/// The decisions at a threshold that need not occur among the scores.
Decisions decisions_at(const std::vector<CurvePoint>& curve, int threshold_q15) {
  Decisions decisions;
  for (const CurvePoint& point : curve) {
    if (point.threshold_q15 >= threshold_q15) decisions = point.decisions;
  }
  return decisions;
}

/// Without the points on a straight line along an axis, of which a good network's curve mostly consists.
SvgPoints corners_of(const SvgPoints& points) {
  SvgPoints corners;
  for (const std::array<double, 2>& p : points) {
    const std::size_t n = corners.size();
    const auto in_line = [&](int axis) { return corners[n - 2][axis] == p[axis] && corners[n - 1][axis] == p[axis]; };
    if (n >= 2 && (in_line(0) || in_line(1))) corners.pop_back();
    corners.push_back(p);
  }
  return corners;
}

std::string text_at(double x, double y, const std::string& text, const char* colour = "#333") {
  return fmt::format("<text font-size='12' fill='{}' x='{:.1f}' y='{:.1f}'>{}</text>\n", colour, x, y,
                     svg_escaped(text));
}

/// Dots with a thin line through them; the labels of each series a line further from their dots.
std::string series(const SvgPanel& panel, const MarkedSeries& marked, std::size_t index,
                   Place (*place)(const Decisions&)) {
  const char* colour = colour_of(index);
  const double away = 14 * static_cast<double>(index);
  SvgPoints points;
  std::string svg;
  std::string last;
  for (const MarkedSeries::Mark& mark : marked.marks) {
    const Place at = place(mark.decisions);
    if (!at) continue;
    if (points.empty()) svg += text_at(panel.x((*at)[0]) + 7, panel.y((*at)[1]) - 7 - away, mark.label, colour);
    points.push_back(*at);
    svg += svg_dot(panel, *at, colour, 3.5);
    last = mark.label;
  }
  if (points.size() > 1) {
    svg += text_at(panel.x(points.back()[0]) + 7, panel.y(points.back()[1]) + 16 + away, last, colour);
  }
  return svg_polyline(panel, points, colour, 1) + svg;
}

std::string legend(const RocPlot& plot, const std::optional<double>& area) {
  double y = kLegend;
  std::string svg;
  const auto line = [&](const char* colour, double width, double dot, const std::string& text) {
    svg += fmt::format(
        "<path d='M{0:.1f} {1:.1f}h24' stroke='{2}' stroke-width='{3}'/><circle cx='{4:.1f}' cy='{1:.1f}' r='{5}' "
        "fill='{2}'/>\n",
        kLeft, y - 4, colour, width, kLeft + 12, dot);
    svg += text_at(kLeft + 34, y, text);
    y += kLine;
  };
  line(kNetworkColour, 2, 5,
       plot.network + ", area under the curve " +
           (area ? fmt::format("{:.5f}", *area) : "undefined: one kind of image is missing"));
  for (std::size_t i = 0; i < plot.others.size(); ++i) line(colour_of(i), 1, 3.5, plot.others[i].name);
  return svg;
}

std::string drawing(const RocPlot& plot, const SvgPanel& panel, const SvgPoints& curve, const char* title,
                    const std::optional<double>& area, Place (*place)(const Decisions&)) {
  const Decisions& all = plot.curve.front().decisions;
  std::string svg = svg_head(kWidth, kLegend + kLine * static_cast<double>(plot.others.size()) + 16, title);
  svg += text_at(56, 52,
                 fmt::format("{} images with the target, {} without; large dot: threshold {:.2f}", all.present(),
                             all.absent(), plot.threshold_q15 / 32768.0));
  svg += panel.frame(true);
  for (std::size_t i = 0; i < plot.others.size(); ++i) svg += series(panel, plot.others[i], i, place);
  svg += svg_polyline(panel, corners_of(curve), kNetworkColour, 2);
  const Place used = place(decisions_at(plot.curve, plot.threshold_q15));
  if (area && used) svg += svg_dot(panel, *used, kNetworkColour, 5);
  return svg + legend(plot, area) + "</svg>\n";
}

}  // namespace

std::string roc_svg(const RocPlot& plot) {
  const SvgPanel panel(kLeft, kTop, kSide, "", "false-positive rate", "true-positive rate");
  const std::optional<double> area = roc_area(plot.curve);
  SvgPoints curve;
  if (area) {
    for (const CurvePoint& point : plot.curve) curve.push_back(*rates(point.decisions));
  }
  return drawing(plot, panel, curve, "Receiver operating characteristic", area, rates);
}

std::string precision_recall_svg(const RocPlot& plot) {
  const SvgPanel panel(kLeft, kTop, kSide, "", "recall", "precision");
  SvgPoints curve;
  double recall = 0;
  for (const CurvePoint& point : plot.curve) {
    const double to = point.decisions.true_positive_rate();
    if (to <= recall) continue;
    curve.push_back({recall, point.decisions.precision()});
    curve.push_back({to, point.decisions.precision()});
    recall = to;
  }
  return drawing(plot, panel, curve, "Precision and recall", average_precision(plot.curve), precision_at);
}

}  // namespace berth::cli
