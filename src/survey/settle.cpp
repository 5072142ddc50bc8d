#include "survey/settle.hpp"

#include <algorithm>
#include <cmath>
#include <limits>

#include "calibration/bent_sides.hpp"
#include "survey/adjust.hpp"

namespace berth {
namespace {

// Corners that far off, in standard deviations as the median residual has them, are wrong: of normal ones 4 in a
// million.
constexpr double kWrong = 5;
// Corners by lines are some hundredths of a pixel off in a marker seen frontally, and some tenths in one seen askance:
// their deviations say nothing of that.
constexpr double kByLines_px = 0.5;
// Cauchy's loss begins there, in standard deviations.
constexpr double kRobust = 2;
constexpr int kRobustRounds = 2, kMostRounds = 10;
// Of the squares of two normal coordinates: chi-square's with two degrees of freedom, 2 ln 2.
constexpr double kMedianSquare = 1.3862943611198906;

// Of a corner in the covariances' units, as half of all corners have it or less: whatever is wrong has no part in it.
double median_deviation(const SurveyNet& net, bool free_sizes) {
  std::vector<double> squares;
  each_corner(net, [&](const Station& station, const Sight&, std::size_t, const Vec2&, double square) {
    if (station.is_used()) squares.push_back(square);
  });
  if (squares.empty()) return 0;
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(squares.size() / 2);
  std::nth_element(squares.begin(), middle, squares.end());
  // The unknowns take up their share of the squares; each corner is two.
  const double all = 2 * static_cast<double>(squares.size());
  const double left = std::max(all - unknowns_of(net, free_sizes), 0.1 * all);
  return std::sqrt(std::max(*middle / kMedianSquare * all / left, 1e-12));  // exact corners, as a test's, have none
}

// Keeps the corners that fit within `most` standard deviations, or as lines of sides seen askance make them. True where
// that changes something.
bool reject(SurveyNet& net, double most) {
  bool changed = false;
  each_corner(net, [&](const Station&, Sight& sight, std::size_t k, const Vec2& off, double square) {
    const bool by_lines = sight.by_lines && off[0] * off[0] + off[1] * off[1] < kByLines_px * kByLines_px;
    const bool keep = square < most * most || (by_lines && finite(square));
    changed = changed || keep != sight.kept[k];
    sight.kept[k] = keep;
  });
  return changed;
}

void straighten(SurveyNet& net) {
  for (Station& station : net.stations) {
    for (Sight& sight : station.sights) {
      if (!sight.by_lines || !sight.is_kept()) continue;
      const BundleMarker& marker = net.markers[sight.marker];
      sight.bend_px = bent_side_shift(net.camera, compose(station.camera, marker.pose), marker.size_m);
    }
  }
}

}  // namespace

bool settle(SurveyNet& net, bool free_sizes) {
  for (int round = 0; round < kMostRounds; ++round) {
    const bool robust = round < kRobustRounds;
    const double deviation = median_deviation(net, free_sizes);
    const bool changed = reject(net, robust ? std::numeric_limits<double>::infinity() : kWrong * deviation);
    if (round > kRobustRounds + 1 && !changed) return true;
    if (!adjust(net, free_sizes, robust ? kRobust * deviation : 0)) return false;
    straighten(net);
  }
  return true;
}

}  // namespace berth
