#include "trajectory_svg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "truth_score.hpp"

namespace berth::cli {
namespace {

constexpr double kPanel = 400, kMargin = 56, kGap = 84, kHeader = 64;
constexpr const char* kTruthColour = "#8a8f98";
constexpr const char* kEstimateColour = "#c8102e";

std::string escaped(const std::string& text) {
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

/// A step of 1, 2 or 5 times a power of ten that cuts the span into four to ten.
double tick_step(double span) {
  double power = 1e-9;
  while (power * 10 <= span / 4) power *= 10;
  for (const double factor : {5.0, 2.0}) {
    if (power * factor <= span / 4) return power * factor;
  }
  return power;
}

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

/// A square plot with its place on the page; data run right and up, unless flipped.
class Panel {
 public:
  Panel(int column, int row, std::string title, std::string across, std::string up)
      : left_(kMargin + column * (kPanel + kGap)),
        top_(kHeader + kMargin / 2 + row * (kPanel + kGap)),
        title_(std::move(title)),
        across_(std::move(across)),
        up_(std::move(up)) {}

  /// Equal scales: both axes get the larger span and a margin.
  void fit_square(Range x, Range y) {
    const double half = 0.54 * std::max({x.span(), y.span(), 0.01});
    fit(x.low / 2 + x.high / 2 - half, x.low / 2 + x.high / 2 + half, y.low / 2 + y.high / 2 - half,
        y.low / 2 + y.high / 2 + half);
  }
  void fit(double x_low, double x_high, double y_low, double y_high) {
    x_low_ = x_low;
    x_high_ = x_high;
    y_low_ = y_low;
    y_high_ = y_high;
  }
  /// Data grow downwards, as image rows do.
  void flip_up() { down_ = true; }

  double x(double v) const { return left_ + kPanel * (v - x_low_) / (x_high_ - x_low_); }
  double y(double v) const {
    const double part = (v - y_low_) / (y_high_ - y_low_);
    return top_ + kPanel * (down_ ? part : 1 - part);
  }

  std::string across_tick(double at, const std::string& label) const {
    return fmt::format(
        "<path class='grid' d='M{0:.1f} {1:.1f}V{2:.1f}'/><text class='tick' x='{0:.1f}' y='{3:.1f}' "
        "text-anchor='middle'>{4}</text>\n",
        x(at), top_, top_ + kPanel, top_ + kPanel + 16, label);
  }
  std::string up_tick(double at, const std::string& label) const {
    return fmt::format(
        "<path class='grid' d='M{0:.1f} {1:.1f}H{2:.1f}'/><text class='tick' x='{3:.1f}' y='{4:.1f}' "
        "text-anchor='end'>{5}</text>\n",
        left_, y(at), left_ + kPanel, left_ - 6, y(at) + 4, label);
  }
  /// Frame, title and axis names, with decimal ticks on the axes asked for.
  std::string frame(bool ticks_up) const {
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
    svg += fmt::format("<rect class='frame' x='{:.1f}' y='{:.1f}' width='{}' height='{}'/>\n", left_, top_, kPanel,
                       kPanel);
    svg += fmt::format("<text class='panel' x='{:.1f}' y='{:.1f}'>{}</text>\n", left_, top_ - 8, title_);
    svg += fmt::format("<text class='axis' x='{:.1f}' y='{:.1f}' text-anchor='end'>{}</text>\n", left_ + kPanel,
                       top_ + kPanel + 33, across_);
    svg +=
        fmt::format("<text class='axis' transform='translate({:.1f} {:.1f}) rotate(-90)' text-anchor='end'>{}</text>\n",
                    left_ - 42, top_, up_);
    return svg;
  }

 private:
  double left_, top_;
  std::string title_, across_, up_;
  double x_low_ = 0, x_high_ = 1, y_low_ = 0, y_high_ = 1;
  bool down_ = false;
};

using Points2 = std::vector<std::array<double, 2>>;

std::string polyline(const Panel& panel, const Points2& points, const char* colour, double width, bool closed = false) {
  if (points.empty()) return "";
  std::string path;
  for (const std::array<double, 2>& p : points) {
    path += fmt::format("{}{:.2f} {:.2f}", path.empty() ? "M" : "L", panel.x(p[0]), panel.y(p[1]));
  }
  return fmt::format(
      "<path d='{}{}' fill='none' stroke='{}' stroke-width='{}' stroke-linejoin='round' stroke-linecap='round'/>\n",
      path, closed ? "Z" : "", colour, width);
}

std::string dot(const Panel& panel, const std::array<double, 2>& at, const char* colour, double radius) {
  return fmt::format("<circle cx='{:.2f}' cy='{:.2f}' r='{}' fill='{}'/>\n", panel.x(at[0]), panel.y(at[1]), radius,
                     colour);
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

Points2 way(const Trajectory& trajectory, Which which, const Axes& axes) {
  Points2 points;
  for (const Trajectory::Point& point : trajectory.points) {
    if (point.*which) points.push_back(axes.of((point.*which)->t));
  }
  return points;
}

/// The marker's square at its last pose; empty when it has none.
Points2 last_square(const Trajectory& trajectory, Which which, const Axes& axes) {
  Points2 square;
  for (auto point = trajectory.points.rbegin(); point != trajectory.points.rend() && square.empty(); ++point) {
    if (!((*point).*which)) continue;
    for (int i = 0; i < 4; ++i) {
      square.push_back(axes.of(transformed(*((*point).*which), marker_corner(i, trajectory.size_m))));
    }
  }
  return square;
}

std::string view(Panel panel, const Trajectory& trajectory, const Axes& axes) {
  const Points2 truth = way(trajectory, &Trajectory::Point::truth, axes);
  const Points2 estimate = way(trajectory, &Trajectory::Point::estimate, axes);
  const Points2 truth_square = last_square(trajectory, &Trajectory::Point::truth, axes);
  const Points2 square = last_square(trajectory, &Trajectory::Point::estimate, axes);
  Range across, up;
  for (const Points2* points : {&truth, &estimate, &truth_square, &square}) {
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
  panel.fit_square(across, up);
  if (axes.up == 1) panel.flip_up();
  std::string svg = panel.frame(true);
  if (with_depth) svg += dot(panel, {0, 0}, "#1f4e8c", 5);
  svg += polyline(panel, truth, kTruthColour, 5) + polyline(panel, truth_square, kTruthColour, 5, true);
  svg += polyline(panel, estimate, kEstimateColour, 1.4) + polyline(panel, square, kEstimateColour, 1.8, true);
  if (!square.empty()) svg += dot(panel, square[0], kEstimateColour, 4.5);
  if (!estimate.empty()) svg += dot(panel, estimate.front(), "#222", 3);
  return svg;
}

std::string error_plot(Panel panel, const Trajectory& trajectory) {
  // Decades from 0.001 % to 10 %; what is better or worse is drawn on the rim.
  constexpr double kLow = -3, kHigh = 1;
  Range range;
  Points2 errors;
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
  for (const std::array<double, 2>& error : errors) svg += dot(panel, error, kEstimateColour, 2);
  return svg;
}

}  // namespace

std::array<double, 3> marker_corner(int i, double size_m) {
  const double half = size_m / 2;
  return {i < 2 ? -half : half, i == 0 || i == 3 ? -half : half, 0};
}

std::string trajectory_svg(const Trajectory& trajectory) {
  const double width = 2 * kMargin + 2 * kPanel + kGap, height = kHeader + 2 * kPanel + 2 * kGap;
  std::string svg = fmt::format(
      "<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 {0} {1}' width='{0}' height='{1}' "
      "font-family='DejaVu Sans, Helvetica, Arial, sans-serif'>\n"
      "<style>.grid{{stroke:#e3e6ea;stroke-width:1}}.frame{{fill:none;stroke:#555;stroke-width:1}}"
      ".tick{{font-size:11px;fill:#555}}.axis{{font-size:12px;fill:#333}}.panel{{font-size:14px;fill:#111;font-weight:"
      "600}}"
      "</style>\n<rect width='{0}' height='{1}' fill='#fff'/>\n",
      width, height);
  svg += fmt::format("<text x='{}' y='30' font-size='18' font-weight='600' fill='#111'>{}</text>\n", kMargin,
                     escaped(trajectory.title));
  svg += fmt::format(
      "<g font-size='12' fill='#333'><path d='M{0} 50h26' stroke='{4}' stroke-width='5'/><text x='{1}' "
      "y='54'>truth</text>"
      "<path d='M{2} 50h26' stroke='{5}' stroke-width='1.6'/><text x='{3}' y='54'>estimate; square: the marker at the "
      "end, "
      "dot: its corner 1; small black dot: start; blue: camera</text></g>\n",
      kMargin, kMargin + 32, kMargin + 84, kMargin + 116, kTruthColour, kEstimateColour);
  svg += view(Panel(0, 0, "from above", "x, m (right)", "z, m (away from the camera)"), trajectory, {0, 2});
  svg += view(Panel(1, 0, "from the camera", "x, m (right)", "y, m (down)"), trajectory, {0, 1});
  svg += view(Panel(0, 1, "from the side", "z, m (away from the camera)", "y, m (down)"), trajectory, {2, 1});
  svg += error_plot(Panel(1, 1, "position error", "range, m", "% of range"), trajectory);
  return svg + "</svg>\n";
}

}  // namespace berth::cli
