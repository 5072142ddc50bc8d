#include "table/sweeps.hpp"

#include <algorithm>
#include <array>

#include "sim/geometry.hpp"
#include "sim/random.hpp"

namespace berth::table {
namespace {

// From and to: the rectangle's extent for x and y, the working range that the paper names for z.
struct Ends {
  double from, to;
};
constexpr std::array<Ends, 6> kEnds = {{{-0.3, 0.3}, {-0.2, 0.2}, {0.15, 1.5}, {-60, 60}, {-60, 60}, {-180, 180}}};

constexpr double kWidth_m = 0.6, kHeight_m = 0.4;

Stop nominal_stop(const Nominal& nominal) { return {0, nominal.size_m, sim::translation(0, 0, nominal.range_m)}; }

}  // namespace

const std::vector<std::string>& axis_names() {
  static const std::vector<std::string> names = {"x", "y", "z", "rx", "ry", "rz"};
  return names;
}

Sweep axis_sweep(std::size_t axis, const Nominal& nominal, int stops) {
  Sweep sweep{axis_names()[axis], axis < 3 ? axis_names()[axis] + ", m" : axis_names()[axis] + ", degrees", axis, {}};
  for (int i = 0; i < stops; ++i) {
    const Ends& ends = kEnds[axis];
    Stop stop = nominal_stop(nominal);
    stop.travel = ends.from + (ends.to - ends.from) * i / (stops - 1);
    if (axis < 3) {
      stop.truth.t[axis] = stop.travel;
    } else {
      std::array<double, 3> turn = {0, 0, 0};
      turn[axis - 3] = sim::radians(stop.travel);
      stop.truth.R = sim::rotation(turn[0], turn[1], turn[2]);
    }
    sweep.stops.push_back(stop);
  }
  return sweep;
}

Sweep rectangle_sweep(const Nominal& nominal, int stops) {
  Sweep sweep{"rectangle", "way, m", std::nullopt, {}};
  for (int i = 0; i < stops; ++i) {
    const double way = 2 * (kWidth_m + kHeight_m) * i / (stops - 1);
    const auto part = [way](double from, double length) { return std::clamp(way - from, 0.0, length); };
    Stop stop = nominal_stop(nominal);
    stop.travel = way;
    stop.truth.t[0] += -kWidth_m / 2 + part(0, kWidth_m) - part(kWidth_m + kHeight_m, kWidth_m);
    stop.truth.t[1] += -kHeight_m / 2 + part(kWidth_m, kHeight_m) - part(2 * kWidth_m + kHeight_m, kHeight_m);
    sweep.stops.push_back(stop);
  }
  return sweep;
}

Sweep still_sweep(const Nominal& nominal, int stops) {
  Sweep sweep{"still", "frame", std::nullopt, {}};
  for (int i = 0; i < stops; ++i) {
    sweep.stops.push_back(nominal_stop(nominal));
    sweep.stops.back().travel = i;
  }
  return sweep;
}

const std::vector<double>& grid_ranges_m() {
  static const std::vector<double> ranges = {0.15, 0.3, 0.5, 1, 1.5};
  return ranges;
}

const std::vector<double>& grid_sizes_m() {
  static const std::vector<double> sizes = {0.02, 0.05, 0.1, 0.2};
  return sizes;
}

std::vector<Sweep> range_grid(int stops, u64 seed) {
  std::vector<Sweep> cells;
  sim::Random random(seed);
  for (const double size_m : grid_sizes_m()) {
    for (const double range_m : grid_ranges_m()) {
      Sweep cell{"ranges", "frame", std::nullopt, {}};
      for (int i = 0; i < stops; ++i) {
        const double x = random.uniform(-0.05, 0.05) * range_m;
        const double y = random.uniform(-0.05, 0.05) * range_m;
        const double rx = random.uniform(-25, 25);
        const double ry = random.uniform(-25, 25);
        const double rz = random.uniform(-180, 180);
        Pose pose = sim::translation(x, y, range_m);
        pose.R = sim::rotation(sim::radians(rx), sim::radians(ry), sim::radians(rz));
        cell.stops.push_back({static_cast<double>(i), size_m, pose});
      }
      cells.push_back(cell);
    }
  }
  return cells;
}

}  // namespace berth::table
