#pragma once

#include "berth/types.hpp"

namespace berth {

// Elementary functions from + - * / and sqrt in a fixed order, so that rendered frames and fisheye poses have the same
// bits under every compiler and libm. They are accurate to a few units in the last place over the ranges needed here;
// that is not the point. The point is that they never change.

constexpr double kPi = 3.14159265358979323846;
/// In a radian; for people to read.
constexpr double kDegrees = 57.295779513082323;

/// Largest integer not above x, |x| < 2^62.
inline long long floor_int(double x) {
  const auto truncated = static_cast<long long>(x);
  return truncated - (x < static_cast<double>(truncated) ? 1 : 0);
}

/// e^x for |x| < 700.
double exact_exp(double x);
/// Natural logarithm of x > 0.
double exact_log(double x);
/// base^exponent for base >= 0; 0 for base 0.
double exact_pow(double base, double exponent);
/// Sine and cosine of an angle, |angle| < 1e6 rad.
double exact_sin(double angle_rad);
double exact_cos(double angle_rad);
/// Arc tangent in -pi/2 … pi/2, of any number.
double exact_atan(double x);
inline double radians(double degrees) { return degrees * (kPi / 180.0); }

/// The standard normal quantile of p, 2^-35 <= p <= 1 - 2^-35 (clamped there).
/// Source: Wichura 1988, algorithm AS 241 (PPND16), without its far tail.
double normal_quantile(double p);

}  // namespace berth
