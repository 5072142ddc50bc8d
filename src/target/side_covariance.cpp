#include "target/side_covariance.hpp"

#include <algorithm>
#include <cmath>

#include "pose_algebra.hpp"
#include "target/sample.hpp"

namespace berth {
namespace {

// Along the middle of a side, where its ends do not show.
constexpr int kStations = 16;
constexpr double kFrom = 0.2, kTo = 0.8;
constexpr double kRootTwoPi = 2.5066282746310002;
// What a difference over one pixel and interpolation add to the blur's variance, and the least that is taken, px².
constexpr double kOwn_px2 = 0.25, kLeast_px2 = 0.08;
// A side without contrast says nothing of its blur.
constexpr double kUnknown_px = 3;

// `across` points out of the marker in the paper's order.
struct Side {
  Vec2 from, along, across;
  double length;
};

Side side_of(const std::array<Vec2, 4>& corners, std::size_t k) {
  const Vec2 &from = corners[k], &to = corners[(k + 1) % 4];
  const double x = to[0] - from[0], y = to[1] - from[1];
  const double length = std::sqrt(x * x + y * y);
  const Vec2 along = {x / length, y / length};
  return {from, along, {-along[1], along[0]}, length};
}

// Beyond this the device leaves a station out, px along its row or column.
constexpr double kFarthest_px = 3.0 / 8;
// Of normal errors the mean distance is root (2 / pi) of their deviation.
constexpr double kDeviations = 1.2533141373155003;
// Without an edge that was refined: the outline's own.
constexpr double kCoarse_px = 0.5;
// What the models below were measured to need (docs/corners.md): stations that were lost weigh so much, and all that
// does not count more than this; what is left where there is no noise, of a shift and of a turn's ends, px.
constexpr double kLost = 10, kMostTimes = 5;
constexpr double kShift_px = 0.0015, kTurn_px = 0.0025;
// What the pixels' phase adds where all stations see nearly the same: a side along rows or columns.
constexpr double kPhaseShift_px = 0.004, kPhaseTurn_px = 0.012;
// Small blurred markers, whose modules run into each other; how much of that is all sides going outwards together, and
// how much more their ends turn.
constexpr double kSmall_px = 260, kSmallSide_px = 18.5, kMostSmall_px = 0.3;
constexpr double kTogether = 0.5, kTurns = 1.15;

double cube(double x) { return x * x * x; }

// How far the line through a side may be off: as a whole, and its ends when it turns about its middle.
struct LineVariance {
  double shift_px2, turn_px2;
};

LineVariance variance_of(const SideFit& fit, const Side& side) {
  if (fit.stations < 3) return {kCoarse_px * kCoarse_px, kCoarse_px * kCoarse_px};
  const double upright = std::max(std::fabs(side.along[0]), std::fabs(side.along[1]));
  const double looked_at = std::max(3.0, side.length * 0.75 - 2);
  // Residuals of normal errors cut off at kFarthest_px: as those errors grow, they tend to half of it.
  const double share = std::min(1.0, 2 * fit.residual_px / kFarthest_px);
  const double cut = 1 - cube(share) * cube(share);
  const double stations = std::max(3.0, std::min(32.0, looked_at * upright));
  const double lost = std::max(0.0, 1 - fit.stations / stations);
  const double times = cut * kMostTimes > 1 + kLost * lost ? (1 + kLost * lost) / cut : kMostTimes;
  const double deviation = kDeviations * fit.residual_px * upright;
  // Two of the residuals' degrees of freedom are the line's.
  const double count = std::max(1.0, fit.stations - 2.0);
  const double variance = times * deviation * deviation / count;
  // Even stations from the first pixel to the last: their squares about the middle add up to a little more than a
  // line's do.
  const double reach = (looked_at - 1) * (looked_at - 1) * (stations + 1) / (stations - 1);
  const double at_ends = 3 * side.length * side.length / reach;
  const double across = looked_at * std::min(std::fabs(side.along[0]), std::fabs(side.along[1]));
  const double phase = 1 / (1 + 2 * across * across);
  return {variance + kShift_px * kShift_px + phase * kPhaseShift_px * kPhaseShift_px,
          at_ends * variance + kTurn_px * kTurn_px + phase * kPhaseTurn_px * kPhaseTurn_px};
}

// What such a marker adds to a side's shift. `blur2`: its blur's square, px², times its modules a side squared.
double small_px2(double side_px, double blur2) {
  const double share2 = blur2 / (side_px * side_px), below = kSmallSide_px / side_px;
  const double small = kSmall_px * cube(share2) * (1 + cube(below) * cube(below));
  return std::min(small, kMostSmall_px) * std::min(small, kMostSmall_px);
}

// How far a corner moves along `other` where `side` ends on it and moves across itself by one.
Vec2 moved_along(const Side& other, const Side& side) {
  const double by = 1 / (other.along[0] * side.across[0] + other.along[1] * side.across[1]);
  return {by * other.along[0], by * other.along[1]};
}

Vec2 scaled(double by, const Vec2& v) { return {by * v[0], by * v[1]}; }

// Adds the square of an error that moves two corners.
void add_square(std::size_t a, const Vec2& by_a, std::size_t b, const Vec2& by_b, CornerCovariance& sum) {
  std::array<double, 8> error{};
  for (std::size_t i = 0; i < 2; ++i) {
    error[2 * a + i] = by_a[i];
    error[2 * b + i] = by_b[i];
  }
  for (std::size_t i = 0; i < 8; ++i) {
    for (std::size_t j = 0; j < 8; ++j) sum[8 * i + j] += error[i] * error[j];
  }
}

}  // namespace

std::array<double, 4> side_blurs(View2D<const u8> image, const std::array<Vec2, 4>& corners_px, int border_width) {
  std::array<double, 4> blurs;
  for (std::size_t k = 0; k < 4; ++k) {
    const Side side = side_of(corners_px, k);
    const double away = 0.5 * side.length / border_width;
    double slope = 0, contrast = 0;
    for (int i = 0; i < kStations; ++i) {
      const double way = side.length * (kFrom + (kTo - kFrom) * i / (kStations - 1));
      const double x = side.from[0] + way * side.along[0], y = side.from[1] + way * side.along[1];
      const auto level = [&](double by, double& value) {
        return sample(image, x + by * side.across[0], y + by * side.across[1], value);
      };
      double out = 0, in = 0, far_out = 0, far_in = 0;
      if (!level(0.5, out) || !level(-0.5, in) || !level(away, far_out) || !level(-away, far_in)) continue;
      slope += out - in;
      contrast += far_out - far_in;
    }
    const double width = contrast / (kRootTwoPi * slope);
    blurs[k] = slope * contrast > 0 ? std::sqrt(std::max(kLeast_px2, width * width - kOwn_px2)) : kUnknown_px;
  }
  return blurs;
}

std::array<Vec2, 4> outwards(const std::array<Vec2, 4>& corners_px) {
  std::array<Vec2, 4> moved;
  for (std::size_t k = 0; k < 4; ++k) {
    const Side before = side_of(corners_px, (k + 3) % 4), after = side_of(corners_px, k);
    const Vec2 by_before = moved_along(after, before), by_after = moved_along(before, after);
    moved[k] = {by_before[0] + by_after[0], by_before[1] + by_after[1]};
  }
  return moved;
}

CornerCovariance side_covariance(const std::array<Vec2, 4>& corners_px, int border_width,
                                 const std::array<SideFit, 4>& fits, const std::array<double, 4>& blurs_px) {
  std::array<Side, 4> sides;
  double length = 0, blur2 = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    sides[k] = side_of(corners_px, k);
    length += sides[k].length / 4;
    blur2 += blurs_px[k] * blurs_px[k] / 4;
  }
  const double small = small_px2(length, blur2 * border_width * border_width);
  CornerCovariance sum{};
  const std::array<Vec2, 4> together = outwards(corners_px);
  for (std::size_t k = 0; k < 4; ++k) {
    const std::size_t next = (k + 1) % 4, before = (k + 3) % 4;
    const LineVariance line = variance_of(fits[k], sides[k]);
    const double shift = std::sqrt(line.shift_px2 + (1 - kTogether) * small);
    const double turn = std::sqrt(line.turn_px2 + kTurns * kTurns * small);
    // A side moves a corner along the other side that meets it there.
    const Vec2 first = moved_along(sides[before], sides[k]), second = moved_along(sides[next], sides[k]);
    add_square(k, scaled(shift, first), next, scaled(shift, second), sum);
    add_square(k, scaled(-turn, first), next, scaled(turn, second), sum);
  }
  for (std::size_t i = 0; i < 8; ++i) {
    for (std::size_t j = 0; j < 8; ++j) {
      sum[8 * i + j] += kTogether * small * together[i / 2][i % 2] * together[j / 2][j % 2];
    }
  }
  return sum;
}

}  // namespace berth
