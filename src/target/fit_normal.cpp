#include "target/fit_normal.hpp"

#include <algorithm>

#include "target/symmetric.hpp"

namespace berth {
namespace {

// A place has levels of its own to tell where its pattern varies by this much (variance of P), and its contrast is not
// taken as less than this, grey levels.
constexpr double kLeastVariance = 0.02;
constexpr double kLeastContrast = 2;

// A pivot with less than this share of its diagonal element is not determined.
constexpr double kLeastShare = 1e-10;

constexpr double kQ12 = 1 / 4096.0, kQ5 = 1 / 32.0;
constexpr std::array<double, kChannels> kUnit = {1, kQ12, kQ12, kQ12, kQ12, kQ12, kQ12, kQ12, kQ5};

using Sums = std::array<std::array<double, kChannels>, kChannels>;

Sums scaled(const ChannelSums& integers) {
  Sums sums;
  for (std::size_t c = 0; c < kChannels; ++c) {
    for (std::size_t d = c; d < kChannels; ++d) sums[c][d] = sums[d][c] = integers[c][d] * (kUnit[c] * kUnit[d]);
  }
  return sums;
}

// Takes channel `c` out of the channels from `first` on: what is left of them has no part that c explains.
void eliminate(std::size_t c, std::size_t first, Sums& sums) {
  for (std::size_t i = first; i < kChannels; ++i) {
    const double share = sums[i][c] / sums[c][c];
    for (std::size_t j = first; j < kChannels; ++j) sums[i][j] -= share * sums[c][j];
  }
}

// Derivatives of the model by the unknowns, channel by channel; each channel has a run of unknowns.
struct Run {
  std::size_t first, end;
};
constexpr Run kRuns[kResidual] = {{kDark, kContrast}, {kContrast, kToneCurve}, {kToneCurve, kField},
                                  {kField, kBlur},    {kField, kBlur},         {kBlur, kUnknowns},
                                  {kBlur, kUnknowns}, {kBlur, kUnknowns}};
using Factors = std::array<FitVector, kResidual>;

void fill_factors(const FitPlace& p, Factors& f) {
  const double levels[6] = {1, p.x, p.y, p.x * p.x, p.x * p.y, p.y * p.y};
  for (std::size_t k = 0; k < 3; ++k) f[kOne][kDark + k] = levels[k];
  for (std::size_t k = 0; k < 6; ++k) f[kLevel][kContrast + k] = levels[k];
  f[kTone][kToneCurve] = p.contrast;
  // A pattern that moves by d shows at a place what was d before it: minus the slope.
  const double u = -p.contrast * p.steep_u, v = -p.contrast * p.steep_v;
  const double field_u[8] = {1, p.a, p.b, 0, 0, 0, p.a * p.a, p.a * p.b};
  const double field_v[8] = {0, 0, 0, 1, p.a, p.b, p.a * p.b, p.b * p.b};
  for (std::size_t k = 0; k < 8; ++k) {
    f[kSlopeU][kField + k] = u * field_u[k];
    f[kSlopeV][kField + k] = v * field_v[k];
  }
  for (std::size_t k = 0; k < 3; ++k) {
    f[kSpreadU][kBlur + k] = -p.contrast * p.wider_u[k];
    f[kSpreadV][kBlur + k] = -p.contrast * p.wider_v[k];
    f[kTwist][kBlur + k] = p.contrast * p.twist[k];
  }
}

}  // namespace

void FitNormal::add(const FitPlace& where, const ChannelSums& integers, bool has_edges) {
  if (integers[kOne][kOne] == 0) return;
  Sums sums = scaled(integers);
  FitPlace place = where;
  std::size_t first = kOne;
  if (tones_ == Tones::local) {
    eliminate(kOne, kLevel, sums);
    const double variance = sums[kLevel][kLevel];
    const bool tells = has_edges && variance >= kLeastVariance * sums[kOne][kOne];
    if (tells) {
      place.contrast = std::max(kLeastContrast, place.contrast + sums[kLevel][kResidual] / variance);
      eliminate(kLevel, kTone, sums);
    }
    squares_ += sums[kResidual][kResidual];
    if (!tells) return;
    first = kTone;
  } else {
    squares_ += sums[kResidual][kResidual];
  }
  const std::size_t end = has_edges ? kResidual : kTone;
  Factors factors;
  fill_factors(place, factors);
  for (std::size_t c = first; c < end; ++c) {
    FitVector with{};  // this channel's sums with every unknown
    for (std::size_t d = first; d < end; ++d) {
      for (std::size_t j = kRuns[d].first; j < kRuns[d].end; ++j) with[j] += sums[c][d] * factors[d][j];
    }
    for (std::size_t i = kRuns[c].first; i < kRuns[c].end; ++i) {
      const double factor = factors[c][i];
      gradient_[i] += factor * sums[c][kResidual];
      for (std::size_t j = i; j < kUnknowns; ++j) matrix_[j * kUnknowns + i] += factor * with[j];
    }
  }
}

void FitNormal::add_prior(const FitVector& factors, double value, double weight) {
  for (std::size_t i = 0; i < kUnknowns; ++i) {
    gradient_[i] -= weight * value * factors[i];
    for (std::size_t j = i; j < kUnknowns; ++j) matrix_[j * kUnknowns + i] += weight * factors[i] * factors[j];
  }
}

bool FitNormal::solve_levels(FitVector& step) const {
  FitMatrix factor = matrix_;
  if (!factorise<kUnknowns>(factor, kLeastShare, kToneCurve)) return false;
  step = berth::solve<kUnknowns>(factor, gradient_, kToneCurve);
  for (std::size_t i = kToneCurve; i < kUnknowns; ++i) step[i] = 0;
  return true;
}

bool FitNormal::solve(FitVector& step, FitMatrix& inverse) const {
  FitMatrix factor = matrix_;
  if (tones_ == Tones::local) {
    for (std::size_t i = 0; i < kToneCurve; ++i) factor[i * kUnknowns + i] = 1;  // held
  }
  if (!factorise<kUnknowns>(factor, kLeastShare)) return false;
  step = berth::solve<kUnknowns>(factor, gradient_);
  for (std::size_t j = 0; j < kUnknowns; ++j) {
    FitVector unit{};
    unit[j] = 1;
    const FitVector column = berth::solve<kUnknowns>(factor, unit);
    for (std::size_t i = 0; i < kUnknowns; ++i) inverse[i * kUnknowns + j] = column[i];
  }
  return true;
}

}  // namespace berth
