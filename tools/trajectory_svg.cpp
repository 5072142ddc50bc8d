#include "trajectory_svg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "svg_panel.hpp"
#include "truth_score.hpp"

namespace berth::cli {
namespace {

constexpr double kSide = 400, kMargin = 56, kGap = 84, kHeader = 64;
constexpr const char* kTruthColour = "#8a8f98";
constexpr const char* kEstimateColour = "#c8102e";

struct Range {
  double low = 0, high = 0;
  bool empty = true;
  void add(double v) {
    low = empty ? v : std::min(low, v);
    high = empty ? v : std::max(high, v);
    empty = false;
  }
  double span() const { return high - low; }
};

SvgPanel panel_at(int column, int row, const char* title, const char* across, const char* up) {
  return {kMargin + column * (kSide + kGap), kHeader + kMargin / 2 + row * (kSide + kGap), kSide, title, across, up};
}

/// Equal scales: both axes get the larger span and a margin.
void fit_square(SvgPanel& panel, const Range& x, const Range& y) {
  const double half = 0.54 * std::max({x.span(), y.span(), 0.01});
  panel.fit(x.low / 2 + x.high / 2 - half, x.low / 2 + x.high / 2 + half, y.low / 2 + y.high / 2 - half,
            y.low / 2 + y.high / 2 + half);
}

std::array<double, 3> transformed(const Pose& pose, const std::array<double, 3>& p) {
  std::array<double, 3> out = pose.t;
  for (int i = 0; i < 3; ++i) out[i] += pose.R[3 * i] * p[0] + pose.R[3 * i + 1] * p[1] + pose.R[3 * i + 2] * p[2];
  return out;
}

/// Two coordinates of the camera frame: x right 0, y down 1, z forward 2.
struct Axes {
  int across, up;
  std::array<double, 2> of(const std::array<double, 3>& p) const { return {p[across], p[up]}; }
};

using Which = std::optional<Pose> Trajectory::Point::*;

SvgPoints way(const Trajectory& trajectory, Which which, const Axes& axes) {
  SvgPoints points;
  for (const Trajectory::Point& point : trajectory.points) {
    if (point.*which) points.push_back(axes.of((point.*which)->t));
  }
  return points;
}

/// The marker's square at its last pose; empty when it has none.
SvgPoints last_square(const Trajectory& trajectory, Which which, const Axes& axes) {
  SvgPoints square;
  for (auto point = trajectory.points.rbegin(); point != trajectory.points.rend() && square.empty(); ++point) {
    if (!((*point).*which)) continue;
    for (int i = 0; i < 4; ++i) {
      square.push_back(axes.of(transformed(*((*point).*which), marker_corner(i, trajectory.size_m))));
    }
  }
  return square;
}

std::string view(SvgPanel panel, const Trajectory& trajectory, const Axes& axes) {
  const SvgPoints truth = way(trajectory, &Trajectory::Point::truth, axes);
  const SvgPoints estimate = way(trajectory, &Trajectory::Point::estimate, axes);
  const SvgPoints truth_square = last_square(trajectory, &Trajectory::Point::truth, axes);
  const SvgPoints square = last_square(trajectory, &Trajectory::Point::estimate, axes);
  Range across, up;
  for (const SvgPoints* points : {&truth, &estimate, &truth_square, &square}) {
    for (const std::array<double, 2>& p : *points) {
      across.add(p[0]);
      up.add(p[1]);
    }
  }
  const bool with_depth = axes.across == 2 || axes.up == 2;
  if (with_depth) {
    across.add(0);
    up.add(0);
  }
  if (across.empty) across.add(0), up.add(0);
  fit_square(panel, across, up);
  if (axes.up == 1) panel.flip_up();
  std::string svg = panel.frame(true);
  if (with_depth) svg += svg_dot(panel, {0, 0}, "#1f4e8c", 5);
  svg += svg_polyline(panel, truth, kTruthColour, 5) + svg_polyline(panel, truth_square, kTruthColour, 5, true);
  svg += svg_polyline(panel, estimate, kEstimateColour, 1.4) + svg_polyline(panel, square, kEstimateColour, 1.8, true);
  if (!square.empty()) svg += svg_dot(panel, square[0], kEstimateColour, 4.5);
  if (!estimate.empty()) svg += svg_dot(panel, estimate.front(), "#222", 3);
  return svg;
}

std::string error_plot(SvgPanel panel, const Trajectory& trajectory) {
  // Decades from 0.001 % to 10 %; what is better or worse is drawn on the rim.
  constexpr double kLow = -3, kHigh = 1;
  Range range;
  SvgPoints errors;
  for (const Trajectory::Point& point : trajectory.points) {
    if (!point.truth || !point.estimate) continue;
    const double range_m = distance_m(Pose(), *point.truth);
    const double percent = 100 * distance_m(*point.truth, *point.estimate) / range_m;
    range.add(range_m);
    errors.push_back({range_m, std::clamp(std::log10(std::max(percent, 1e-9)), kLow, kHigh)});
  }
  if (errors.empty()) return "";
  const double margin = 0.04 * std::max(range.span(), 0.01);
  panel.fit(range.low - margin, range.high + margin, kLow, kHigh);
  std::string svg = panel.frame(false);
  for (int decade = -3; decade <= 1; ++decade)
    svg += panel.up_tick(decade, fmt::format("{:g}", std::pow(10.0, decade)));
  for (const std::array<double, 2>& error : errors) svg += svg_dot(panel, error, kEstimateColour, 2);
  return svg;
}

}  // namespace

std::array<double, 3> marker_corner(int i, double size_m) {
  const double half = size_m / 2;
  return {i < 2 ? -half : half, i == 0 || i == 3 ? -half : half, 0};
}

std::string trajectory_svg(const Trajectory& trajectory) {
  const double width = 2 * kMargin + 2 * kSide + kGap, height = kHeader + 2 * kSide + 2 * kGap;
  std::string svg = svg_head(width, height, trajectory.title);
  svg += fmt::format(
      "<g font-size='12' fill='#333'><path d='M{0} 50h26' stroke='{4}' stroke-width='5'/><text x='{1}' "
      "y='54'>truth</text>"
      "<path d='M{2} 50h26' stroke='{5}' stroke-width='1.6'/><text x='{3}' y='54'>estimate; square: the marker at the "
      "end, "
      "dot: its corner 1; small black dot: start; blue: camera</text></g>\n",
      kMargin, kMargin + 32, kMargin + 84, kMargin + 116, kTruthColour, kEstimateColour);
  svg += view(panel_at(0, 0, "from above", "x, m (right)", "z, m (away from the camera)"), trajectory, {0, 2});
  svg += view(panel_at(1, 0, "from the camera", "x, m (right)", "y, m (down)"), trajectory, {0, 1});
  svg += view(panel_at(0, 1, "from the side", "z, m (away from the camera)", "y, m (down)"), trajectory, {2, 1});
  svg += error_plot(panel_at(1, 1, "position error", "range, m", "% of range"), trajectory);
  return svg + "</svg>\n";
}

}  // namespace berth::cli
