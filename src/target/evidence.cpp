#include "target/evidence.hpp"

#include <algorithm>
#include <cmath>

namespace berth {
namespace {

// The rest a pattern leaves unexplained is never taken as less than this share: the blur model is no better.
constexpr double kLeastRest = 1e-3;

double power(double base, std::size_t exponent) {
  double result = 1;
  for (std::size_t i = 0; i < exponent; ++i) result *= base;
  return result;
}

// The regression of the reading on what a pattern would show, kept up to date while cells are turned over.
class Regression {
 public:
  Regression(const Layout& layout, const Reading& reading, u64 word, BlurTaps taps)
      : layout_(layout), n_(layout.x.size()), word_(word) {
    blurred_code(layout, word, taps, shown_);
    double sum = 0;
    for (std::size_t i = 0; i < n_; ++i) sum += reading.value[i];
    for (std::size_t i = 0; i < n_; ++i) {
      value_[i] = reading.value[i] - sum / static_cast<double>(n_);
      yy_ += value_[i] * value_[i];
      sums_.p += shown_[i];
      sums_.pp += shown_[i] * shown_[i];
      sums_.yp += value_[i] * shown_[i];
    }
    const double cu = 1 - 2 * taps.u, cv = 1 - 2 * taps.v;
    own_ = cu * cv;
    weight_ = {taps.u * taps.v, cu * taps.v,     taps.u * taps.v, taps.u * cv,
               taps.u * cv,     taps.u * taps.v, cu * taps.v,     taps.u * taps.v};
  }

  /// Share of the reading that the pattern leaves unexplained.
  double rest() const { return rest_of(sums_); }
  double rest_without(std::size_t cell) const { return rest_of(turned_sums(cell)); }

  void turn_over(std::size_t cell) {
    sums_ = turned_sums(cell);
    const double change = change_of(cell);
    shown_[cell] += change * own_;
    for (std::size_t k = 0; k < 8; ++k) {
      const int near = layout_.neighbours[8 * cell + k];
      if (near >= 0) shown_[near] += change * weight_[k];
    }
    word_ ^= u64{1} << cell;
  }

 private:
  struct Sums {
    double p = 0, pp = 0, yp = 0;
  };

  double change_of(std::size_t cell) const { return (word_ >> cell) & 1 ? -2 : 2; }

  Sums turned_sums(std::size_t cell) const {
    Sums sums = sums_;
    const double change = change_of(cell);
    const auto add = [&](std::size_t i, double d) {
      sums.p += d;
      sums.pp += d * (2 * shown_[i] + d);
      sums.yp += value_[i] * d;
    };
    add(cell, change * own_);
    for (std::size_t k = 0; k < 8; ++k) {
      const int near = layout_.neighbours[8 * cell + k];
      if (near >= 0) add(static_cast<std::size_t>(near), change * weight_[k]);
    }
    return sums;
  }

  double rest_of(const Sums& sums) const {
    const double pp = sums.pp - sums.p * sums.p / static_cast<double>(n_);
    if (!(sums.yp > 0) || !(pp > 0) || !(yy_ > 0)) return 1;
    return std::max(kLeastRest, 1 - sums.yp * sums.yp / (pp * yy_));
  }

  const Layout& layout_;
  std::size_t n_;
  u64 word_;
  double yy_ = 0;
  Sums sums_;
  double own_ = 0;
  std::array<double, 8> weight_;
  std::array<double, kMaxCells> value_, shown_;
};

}  // namespace

double evidence_against_chance(const Layout& layout, const Reading& reading, u64 word, BlurTaps taps) {
  const std::size_t n = layout.x.size();
  Regression regression(layout, reading, word, taps);
  const double rest = regression.rest();
  double best = rest;
  for (std::size_t round = 0; round < n; ++round) {
    std::size_t cell = n;
    for (std::size_t i = 0; i < n; ++i) {
      const double turned = regression.rest_without(i);
      if (turned < best) {
        best = turned;
        cell = i;
      }
    }
    if (cell == n) break;
    regression.turn_over(cell);
    best = regression.rest();
  }
  // Likelihood of Gaussian noise of unknown size: rest^(-n / 2). `odds` is kept squared until the end.
  double odds = power(best / rest, n);
  for (std::size_t i = 0; i < n; ++i) {
    const double other = std::sqrt(power(best / std::max(best, regression.rest_without(i)), n));
    odds *= 4 / ((1 + other) * (1 + other));
  }
  return std::sqrt(odds);
}

}  // namespace berth
