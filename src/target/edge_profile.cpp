#include "target/edge_profile.hpp"

namespace berth {
namespace {

// e^-x for 0 <= x <= 8: the series of a 256th of it, squared eight times.
double exp_minus(double x) {
  const double small = x / 256;
  double sum = 1;
  for (int n = 12; n >= 1; --n) sum = 1 + small * sum / n;
  for (int k = 0; k < 8; ++k) sum *= sum;
  return 1 / sum;
}

constexpr double kInverseRootTwoPi = 0.39894228040143267794;

// The normal distribution between 0 and t, of which `density` is the derivative there: t + t^3/3 + t^5/(3 5) + …
double normal_area(double t, double density) {
  double sum = 0, term = t;
  for (int n = 1; n < 121; n += 2) {
    sum += term;
    term *= t * t / (n + 2);
  }
  return density * sum;
}

std::int16_t rounded(double value) { return static_cast<std::int16_t>(value < 0 ? value - 0.5 : value + 0.5); }
std::int16_t q14(double value) { return rounded(value * 16384); }

double density_at(double t) { return kInverseRootTwoPi * exp_minus(t * t / 2); }

// Hermite's cubics through values and slopes at the pieces' ends; the last ends level. The scale leaves room for what
// rounding adds.
EdgePieces make_pieces() {
  constexpr double kLength = 0.5, kOne = 32764;
  EdgePieces pieces;
  for (std::size_t k = 0; k < 8; ++k) {
    const double from = kLength * static_cast<double>(k), to = from + kLength;
    const double slope = density_at(from), end_slope = k == 7 ? 0 : density_at(to);
    const double value = 2 * normal_area(from, slope), end = k == 7 ? 1 : 2 * normal_area(to, end_slope);
    const double m = 2 * slope * kLength, end_m = 2 * end_slope * kLength;
    pieces[0][k] = rounded(kOne * value);
    pieces[1][k] = rounded(kOne * m);
    pieces[2][k] = rounded(kOne * (3 * (end - value) - 2 * m - end_m));
    pieces[3][k] = rounded(kOne * (2 * (value - end) + m + end_m));
  }
  return pieces;
}

}  // namespace

EdgeProfile::EdgeProfile() : pieces_(make_pieces()) {
  for (int i = 0; i <= 2 * kMiddle; ++i) {
    const double t = static_cast<double>(i - kMiddle) / (1 << kPerDeviation_bits);
    const double density = density_at(t);
    points_[static_cast<std::size_t>(i)] = {q14(0.5 + normal_area(t, density)), q14(density), q14(t * density)};
  }
  points_.front() = {0, 0, 0};
  points_.back() = {16384, 0, 0};
}

}  // namespace berth
