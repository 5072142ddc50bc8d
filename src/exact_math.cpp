#include "exact_math.hpp"

#include <cmath>
#include <cstring>

namespace berth {
namespace {

constexpr double kLn2 = 0.69314718055994530942;
constexpr double kHalfPi = kPi / 2;
// What kHalfPi lost when it was rounded to a double.
constexpr double kHalfPiRest = 6.123233995736766036e-17;

// 2^k by its bit pattern, -1022 <= k <= 1023.
double power_of_two(long long k) {
  const u64 bits = static_cast<u64>(k + 1023) << 52;
  double value;
  std::memcpy(&value, &bits, sizeof value);
  return value;
}

// sin for |r| <= pi/4.
double sin_core(double r) {
  const double s = r * r;
  double sum = 1;
  for (int n = 18; n >= 2; n -= 2) sum = 1 - s * sum / static_cast<double>(n * (n + 1));
  return r * sum;
}

double cos_core(double r) {
  const double s = r * r;
  double sum = 1;
  for (int n = 17; n >= 1; n -= 2) sum = 1 - s * sum / static_cast<double>(n * (n + 1));
  return sum;
}

// sin(angle + quarters * pi/2)
double sin_shifted(double angle, int quarters) {
  const long long turns = floor_int(angle / kHalfPi + 0.5);
  const double k = static_cast<double>(turns);
  const double r = (angle - k * kHalfPi) - k * kHalfPiRest;
  switch ((turns + quarters) & 3) {
    case 0:
      return sin_core(r);
    case 1:
      return cos_core(r);
    case 2:
      return -sin_core(r);
    default:
      return -cos_core(r);
  }
}

template <int N>
double polynomial(const double (&coefficients)[N], double x) {
  double sum = coefficients[N - 1];
  for (int i = N - 2; i >= 0; --i) sum = sum * x + coefficients[i];
  return sum;
}

}  // namespace

double exact_exp(double x) {
  const long long k = floor_int(x / kLn2 + 0.5);
  const double r = x - static_cast<double>(k) * kLn2;
  double sum = 1;
  for (int n = 14; n >= 1; --n) sum = 1 + r * sum / n;
  return k < -1022 ? 0 : sum * power_of_two(k);
}

double exact_log(double x) {
  int exponent = 0;
  double mantissa = std::frexp(x, &exponent);  // exact: takes the number apart
  if (mantissa < 0.70710678118654752440) {
    mantissa *= 2;
    --exponent;
  }
  const double s = (mantissa - 1) / (mantissa + 1);
  const double s2 = s * s;
  double sum = 0;
  for (int n = 25; n >= 1; n -= 2) sum = sum * s2 + 1.0 / n;
  return 2 * s * sum + exponent * kLn2;
}

double exact_pow(double base, double exponent) { return base > 0 ? exact_exp(exponent * exact_log(base)) : 0; }

double exact_sin(double angle_rad) { return sin_shifted(angle_rad, 0); }
double exact_cos(double angle_rad) { return sin_shifted(angle_rad, 1); }

double exact_atan(double x) {
  if (x < 0) return -exact_atan(-x);
  if (x > 1) return (kHalfPi - exact_atan(1 / x)) + kHalfPiRest;
  // Half the angle, twice: the series below then has 0.2 or less to deal with.
  double t = x;
  for (int i = 0; i < 2; ++i) t /= 1 + std::sqrt(1 + t * t);
  const double s = t * t;
  double sum = 0;
  for (int n = 25; n >= 1; n -= 2) sum = 1.0 / n - s * sum;
  return 4 * t * sum;
}

double normal_quantile(double p) {
  static constexpr double kA[] = {3.3871328727963666080e0, 1.3314166789178437745e2, 1.9715909503065514427e3,
                                  1.3731693765509461125e4, 4.5921953931549871457e4, 6.7265770927008700853e4,
                                  3.3430575583588128105e4, 2.5090809287301226727e3};
  static constexpr double kB[] = {1.0,
                                  4.2313330701600911252e1,
                                  6.8718700749205790830e2,
                                  5.3941960214247511077e3,
                                  2.1213794301586595867e4,
                                  3.9307895800092710610e4,
                                  2.8729085735721942674e4,
                                  5.2264952788528545610e3};
  static constexpr double kC[] = {1.42343711074968357734e0,  4.63033784615654529590e0, 5.76949722146069140550e0,
                                  3.64784832476320460504e0,  1.27045825245236838258e0, 2.41780725177450611770e-1,
                                  2.27238449892691845833e-2, 7.74545014278341407640e-4};
  static constexpr double kD[] = {1.0,
                                  2.05319162663775882187e0,
                                  1.67638483018380384940e0,
                                  6.89767334985100004550e-1,
                                  1.48103976427480074590e-1,
                                  1.51986665636164571966e-2,
                                  5.47593808499534494600e-4,
                                  1.05075007164441684324e-9};
  constexpr double kLeast = 1.0 / 34359738368.0;  // 2^-35: beyond it AS 241 needs a third pair of polynomials
  if (p < kLeast) p = kLeast;
  if (p > 1 - kLeast) p = 1 - kLeast;
  const double q = p - 0.5;
  if (q <= 0.425 && q >= -0.425) {
    const double r = 0.180625 - q * q;
    return q * polynomial(kA, r) / polynomial(kB, r);
  }
  const double r = std::sqrt(-exact_log(q < 0 ? p : 1 - p)) - 1.6;
  const double tail = polynomial(kC, r) / polynomial(kD, r);
  return q < 0 ? -tail : tail;
}

}  // namespace berth
