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

std::int16_t q14(double value) {
  const double scaled = value * 16384;
  return static_cast<std::int16_t>(scaled < 0 ? scaled - 0.5 : scaled + 0.5);
}

}  // namespace

EdgeProfile::EdgeProfile() {
  for (int i = 0; i <= 2 * kMiddle; ++i) {
    const double t = static_cast<double>(i - kMiddle) / (1 << kPerDeviation_bits);
    const double density = kInverseRootTwoPi * exp_minus(t * t / 2);
    points_[static_cast<std::size_t>(i)] = {q14(0.5 + normal_area(t, density)), q14(density), q14(t * density)};
  }
  points_.front() = {0, 0, 0};
  points_.back() = {16384, 0, 0};
}

}  // namespace berth
