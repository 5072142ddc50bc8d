#include "table_svg.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <iterator>

#include "exact_math.hpp"
#include "svg_panel.hpp"
#include "trajectory_svg.hpp"

namespace berth::cli {
namespace {

constexpr double kLeft = 76, kTop = 96, kSide = 300, kAcross = kSide + 96, kDown = kSide + 84;
constexpr const char* kColours[] = {"#c8102e", "#e09f3e", "#7a5c00", "#1f4e8c", "#5fa8d3"};

const char* colour_of(std::size_t method) { return kColours[method % std::size(kColours)]; }

std::string legend(const MethodNames& methods) {
  std::string svg;
  double x = 56;
  for (std::size_t m = 0; m < methods.size(); ++m) {
    svg += fmt::format(
        "<path d='M{0} 50h22' stroke='{1}' stroke-width='2'/><text x='{2}' y='54' font-size='12' fill='#333'>{3}</text>"
        "\n",
        x, colour_of(m), x + 28, svg_escaped(methods[m]));
    x += 52 + 6.6 * static_cast<double>(methods[m].size());
  }
  return svg;
}

SvgPanel panel_at(int column, int row, const std::string& title, const std::string& across, const std::string& up) {
  return {kLeft + kAcross * column, kTop + kDown * row, kSide, title, across, up};
}

/// Of every method's readings of the wholly shown frames, in turn.
using Lines = std::vector<SvgPoints>;
template <class PointOf>
Lines lines_of(const TableSweep& run, std::size_t methods, const PointOf& point_of) {
  Lines lines(methods);
  for (const TableFrame& frame : run.frames) {
    for (std::size_t m = 0; m < methods && frame.shown; ++m) {
      if (frame.readings[m]) lines[m].push_back(point_of(frame, *frame.readings[m]));
    }
  }
  return lines;
}

/// Frame and lines, the scales to hold all of them; the first method on top.
std::string drawn(SvgPanel panel, const Lines& lines, bool down = false) {
  std::array<double, 2> low = {1e300, 1e300};
  std::array<double, 2> high = {-1e300, -1e300};
  for (const SvgPoints& line : lines) {
    for (const std::array<double, 2>& p : line) {
      for (std::size_t k = 0; k < 2; ++k) {
        low[k] = std::min(low[k], p[k]);
        high[k] = std::max(high[k], p[k]);
      }
    }
  }
  if (low[0] > high[0]) return "";
  const auto margin = [&](std::size_t k) { return 0.04 * std::max(high[k] - low[k], 1e-6); };
  panel.fit(low[0] - margin(0), high[0] + margin(0), low[1] - margin(1), high[1] + margin(1));
  if (down) panel.flip_up();
  std::string svg = panel.frame(true);
  for (std::size_t m = lines.size(); m-- > 0;) svg += svg_polyline(panel, lines[m], colour_of(m), m == 0 ? 1.8 : 1.1);
  return svg;
}

double error_of(const TableFrame& frame, const Reading& reading, std::size_t axis) {
  return table::pose_error(reading.pose, frame.truth.pose)[axis] * (axis < 3 ? 1000 : kDegrees);
}

}  // namespace

std::string axes_svg(const std::vector<TableSweep>& sweeps, const MethodNames& methods) {
  std::string body;
  int column = 0;
  for (const TableSweep& run : sweeps) {
    if (!run.sweep.axis) continue;
    const std::size_t axis = *run.sweep.axis;
    const auto measured = [axis](const TableFrame& frame, const Reading& reading) {
      const double error = table::pose_error(reading.pose, frame.truth.pose)[axis] * (axis < 3 ? 1 : kDegrees);
      return std::array<double, 2>{frame.travel, frame.travel + error};
    };
    const auto error = [axis](const TableFrame& frame, const Reading& reading) {
      return std::array<double, 2>{frame.travel, error_of(frame, reading, axis)};
    };
    const std::string& name = run.sweep.name;
    body += drawn(panel_at(column, 0, name, run.sweep.travel, "measured"), lines_of(run, methods.size(), measured));
    body += drawn(panel_at(column, 1, "error of " + name, run.sweep.travel, axis < 3 ? "mm" : "degrees"),
                  lines_of(run, methods.size(), error));
    // The first method by itself: the others' scale may hide it.
    body += drawn(panel_at(column, 2, fmt::format("the same, {}", methods.front()), run.sweep.travel,
                           axis < 3 ? "mm" : "degrees"),
                  lines_of(run, 1, error));
    ++column;
  }
  return svg_head(kLeft + kAcross * std::max(column, 3), kTop + kDown * 3, "Single axes of the virtual table") +
         legend(methods) + body + "</svg>\n";
}

std::string rectangle_svg(const TableSweep& sweep, const MethodNames& methods) {
  const auto place = [](const TableFrame&, const Reading& reading) {
    return std::array<double, 2>{reading.pose.t[0], reading.pose.t[1]};
  };
  const auto along = [](std::size_t axis) {
    return [axis](const TableFrame& frame, const Reading& reading) {
      return std::array<double, 2>{frame.travel, error_of(frame, reading, axis)};
    };
  };
  std::string svg = svg_head(kLeft + kAcross * 3, kTop + kDown * 2, "Rectangle of 60 × 40 cm") + legend(methods);
  svg += drawn(panel_at(0, 0, "XY", "x, m", "y, m"), lines_of(sweep, methods.size(), place), true);
  const char* names[] = {"Z-XY", "Rz-XY"};
  const char* units[] = {"error of z, mm", "error of rz, degrees"};
  for (std::size_t k = 0; k < 2; ++k) {
    const std::size_t axis = k == 0 ? 2 : 5;
    const int column = static_cast<int>(k) + 1;
    svg += drawn(panel_at(column, 0, names[k], "way, m", units[k]), lines_of(sweep, methods.size(), along(axis)));
    svg += drawn(panel_at(column, 1, fmt::format("the same, {}", methods.front()), "way, m", units[k]),
                 lines_of(sweep, 1, along(axis)));
  }
  return svg + "</svg>\n";
}

std::string rectangle_trajectory_svg(const TableSweep& sweep) {
  Trajectory trajectory;
  trajectory.title = "The marker around the rectangle, in the camera's frame";
  for (const TableFrame& frame : sweep.frames) {
    trajectory.size_m = frame.truth.size_m;
    Trajectory::Point point;
    point.truth = frame.truth.pose;
    if (frame.readings.front()) point.estimate = frame.readings.front()->pose;
    trajectory.points.push_back(point);
  }
  return trajectory_svg(trajectory);
}

}  // namespace berth::cli
