#include "survey/settle.hpp"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

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
constexpr int kMostRounds = 10;
// Deviations by these shares of the corners, in turn: at first even a marker that starts badly pulls, and is pulled.
constexpr std::array<double, 3> kRobustShares = {0.95, 0.8, 0.5};

// Of a corner in the covariances' units, as that share of all corners have it or less: with a half, whatever is wrong
// has no part in it.
double deviation_of(const SurveyNet& net, bool free_sizes, double share) {
  std::vector<double> squares;
  each_corner(net, [&](const SurveyStation& station, const Sight&, std::size_t, const Vec2&, double square) {
    if (station.is_used()) squares.push_back(square);
  });
  if (squares.empty()) return 0;
  const auto middle = squares.begin() + static_cast<std::ptrdiff_t>(share * static_cast<double>(squares.size() - 1));
  std::nth_element(squares.begin(), middle, squares.end());
  // The unknowns take up their share of the squares; each corner is two.
  const double all = 2 * static_cast<double>(squares.size());
  const double left = std::max(all - unknowns_of(net, free_sizes), 0.1 * all);
  // Of the sum of squares of two normal coordinates: chi-square's with two degrees of freedom.
  const double expected = -2 * std::log(1 - share);
  return std::sqrt(std::max(*middle / expected * all / left, 1e-12));  // exact corners, as a test's, have none
}

// Keeps the corners that fit within `most` standard deviations, or as lines of sides seen askance make them. True where
// that changes something.
bool reject(SurveyNet& net, double most) {
  bool changed = false;
  each_corner(net, [&](const SurveyStation&, Sight& sight, std::size_t k, const Vec2& off, double square) {
    const bool by_lines = sight.by_lines && off[0] * off[0] + off[1] * off[1] < kByLines_px * kByLines_px;
    const bool keep = square < most * most || (by_lines && finite(square));
    changed = changed || keep != sight.kept[k];
    sight.kept[k] = keep;
  });
  return changed;
}

}  // namespace

bool settle(SurveyNet& net, bool free_sizes) {
  for (int round = 0; round < kMostRounds; ++round) {
    const bool robust = round < static_cast<int>(kRobustShares.size());
    const double share = robust ? kRobustShares[static_cast<std::size_t>(round)] : 0.5;
    const double deviation = deviation_of(net, free_sizes, share);
    const bool changed = reject(net, robust ? std::numeric_limits<double>::infinity() : kWrong * deviation);
    if (round > static_cast<int>(kRobustShares.size()) + 1 && !changed) return true;
    if (!adjust(net, free_sizes, robust ? kRobust * deviation : 0)) return false;
  }
  return true;
}

}  // namespace berth
