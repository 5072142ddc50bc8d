#pragma once

#include <cmath>
#include <cstdint>

namespace berth::reference {

/// a / b to nearest, halves away from zero; b > 0.
inline std::int64_t divide_rounded(std::int64_t a, std::int64_t b) {
  const std::int64_t size = a < 0 ? -a : a;
  const std::int64_t quotient = (size + b / 2) / b;
  return a < 0 ? -quotient : quotient;
}

/// floor(sqrt(a)), a < 2^32.
inline int square_root(std::int64_t a) {
  std::int64_t root = static_cast<std::int64_t>(std::sqrt(static_cast<double>(a)));
  while (root * root > a) --root;
  while ((root + 1) * (root + 1) <= a) ++root;
  return static_cast<int>(root);
}

/// Sums of a straight line's points (u along, v across), added one by one.
class LineFit {
 public:
  void add(std::int64_t u, std::int64_t v) {
    ++n_;
    u_ += u;
    v_ += v;
    uu_ += u * u;
    uv_ += u * v;
  }
  int points() const { return static_cast<int>(n_); }
  std::int64_t mean_u() const { return divide_rounded(u_, n_); }
  /// n times the variance of u: about the rounded mean, then corrected for the rest, rounded.
  std::int64_t spread() const { return moment(u_, u_, uu_); }
  /// dv / du with q fractional bits, within ±limit. Divisor and dividend are first shifted right together until the
  /// divisor has 15 bits.
  int slope(int q, int limit) const {
    const std::int64_t a = moment(u_, v_, uv_);
    std::int64_t size = a < 0 ? -a : a;
    std::int64_t over = spread();
    while (over >= 1 << 15) {
      over /= 2;
      size /= 2;
    }
    const std::int64_t ratio =
        size >= limit * over ? std::int64_t{limit} << q : (size * (std::int64_t{1} << q) + over / 2) / over;
    return static_cast<int>(a < 0 ? -ratio : ratio);
  }
  /// 256 times the line's value at mean_u, for its slope with q fractional bits.
  int value_q8(int slope, int q) const {
    const std::int64_t mean_v = divide_rounded(v_, n_);
    const std::int64_t rest_u = u_ - n_ * mean_u();
    const std::int64_t rest_v = v_ - n_ * mean_v;
    const std::int64_t lift = floor_shift(slope * rest_u, q - 8);
    return static_cast<int>(mean_v * 256 + divide_rounded(rest_v * 256 - lift, n_));
  }
  static std::int64_t floor_shift(std::int64_t a, int by) {
    const std::int64_t unit = std::int64_t{1} << by;
    return a >= 0 ? a / unit : -((-a + unit - 1) / unit);
  }

 private:
  std::int64_t moment(std::int64_t a, std::int64_t b, std::int64_t ab) const {
    const std::int64_t mean_a = divide_rounded(a, n_);
    const std::int64_t mean_b = divide_rounded(b, n_);
    const std::int64_t about = ab - mean_a * b - mean_b * a + n_ * mean_a * mean_b;
    return about - divide_rounded((a - n_ * mean_a) * (b - n_ * mean_b), n_);
  }

  std::int64_t n_ = 0, u_ = 0, v_ = 0, uu_ = 0, uv_ = 0;
};

/// Half pixels trimmed off both ends of a side before its line is fitted.
inline int side_trim(int length) {
  const int trim = length / 8 + 2;
  return length - 2 * trim < 6 ? 0 : trim;
}

/// How often a side's coordinates are halved for its fit.
inline int side_halvings(int length) {
  int halvings = 0;
  for (int rest = length; rest > 800; rest /= 2) ++halvings;
  return halvings;
}

}  // namespace berth::reference
