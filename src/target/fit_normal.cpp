#include "target/fit_normal.hpp"

#include "target/symmetric.hpp"

namespace berth {
namespace {

// A pivot with less than this share of its diagonal element is not determined.
constexpr double kLeastShare = 1e-10;

}  // namespace

void FitNormal::add_prior(const FitVector& factors, double value, double weight) {
  for (std::size_t i = 0; i < kUnknowns; ++i) {
    equations_.rows[i][FitEquations::kGradient] -= weight * value * factors[i];
    for (std::size_t j = i; j < kUnknowns; ++j) equations_.rows[i][j] += weight * factors[i] * factors[j];
  }
}

FitMatrix FitNormal::lower() const {
  FitMatrix lower;
  for (std::size_t i = 0; i < kUnknowns; ++i) {
    for (std::size_t j = i; j < kUnknowns; ++j) lower[j * kUnknowns + i] = equations_.rows[i][j];
  }
  return lower;
}

bool FitNormal::solve_levels(FitVector& step) const {
  FitMatrix factor = lower();
  if (!factorise<kUnknowns>(factor, kLeastShare, kToneCurve)) return false;
  step = berth::solve<kUnknowns>(factor, equations_.gradient(), kToneCurve);
  for (std::size_t i = kToneCurve; i < kUnknowns; ++i) step[i] = 0;
  return true;
}

bool FitNormal::solve(FitVector& step, FitMatrix& factor) const {
  factor = lower();
  if (tones_ == Tones::local) {
    for (std::size_t i = 0; i < kToneCurve; ++i) factor[i * kUnknowns + i] = 1;  // held
  }
  if (!factorise<kUnknowns>(factor, kLeastShare)) return false;
  step = berth::solve<kUnknowns>(factor, equations_.gradient());
  return true;
}

std::array<double, kUnknowns - kField> whitened(const FitMatrix& factor, const std::array<double, 8>& field) {
  std::array<double, kUnknowns - kField> y{};
  for (std::size_t i = 0; i < y.size(); ++i) {
    double value = i < field.size() ? field[i] : 0;
    const double* const row = &factor[(kField + i) * kUnknowns + kField];
    for (std::size_t k = 0; k < i; ++k) value -= row[k] * y[k];
    y[i] = value / row[i];
  }
  return y;
}

}  // namespace berth
