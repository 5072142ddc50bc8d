#include "target/fit_normal.hpp"

#include <algorithm>
#include <type_traits>

#include "target/symmetric.hpp"

namespace berth {
namespace {

// A place has levels of its own to tell where its pattern varies by this much (variance of P), and its contrast is not
// taken as less than this, grey levels.
constexpr double kLeastVariance = 0.02;
constexpr double kLeastContrast = 2;

// A pivot with less than this share of its diagonal element is not determined.
constexpr double kLeastShare = 1e-10;

constexpr double kQ11 = 1 / 2048.0, kQ4 = 1 / 16.0;
constexpr std::array<double, kChannels> kUnit = {1, kQ11, kQ11, kQ11, kQ11, kQ11, kQ11, kQ11, kQ4};

using Sums = std::array<std::array<double, kChannels>, kChannels>;

Sums scaled(const ChannelSums& integers) {
  Sums sums;
  std::size_t k = 0;
  for (std::size_t c = 0; c < kChannels; ++c) {
    for (std::size_t d = c; d < kChannels; ++d, ++k) sums[c][d] = sums[d][c] = integers[k] * (kUnit[c] * kUnit[d]);
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

// A run of unknowns that a place's channels depend on by these factors.
template <std::size_t kFirst, std::size_t kCount>
struct Factors {
  static constexpr std::size_t first = kFirst, count = kCount;
  std::array<double, kCount> at;
};

// Derivatives of the model by the unknowns, channel by channel.
struct Derivatives {
  explicit Derivatives(const FitPlace& p)
      : dark{{1, p.x, p.y}},
        contrast{{1, p.x, p.y, p.x * p.x, p.x * p.y, p.y * p.y}},
        tone{{p.contrast}},
        // A pattern that moves by d shows at a place what was d before it: minus the slope.
        slope_u{{u(p), u(p) * p.a, u(p) * p.b, 0, 0, 0, u(p) * p.a * p.a, u(p) * p.a * p.b}},
        slope_v{{0, 0, 0, v(p), v(p) * p.a, v(p) * p.b, v(p) * p.a * p.b, v(p) * p.b * p.b}} {
    for (std::size_t k = 0; k < 3; ++k) {
      spread_u.at[k] = -p.contrast * p.wider_u[k];
      spread_v.at[k] = -p.contrast * p.wider_v[k];
      twist.at[k] = p.contrast * p.twist[k];
    }
  }
  static double u(const FitPlace& p) { return -p.contrast * p.steep_u; }
  static double v(const FitPlace& p) { return -p.contrast * p.steep_v; }

  Factors<kDark, 3> dark;
  Factors<kContrast, 6> contrast;
  Factors<kToneCurve, 1> tone;
  Factors<kField, 8> slope_u, slope_v;
  Factors<kBlur, 3> spread_u, spread_v, twist;
};

constexpr std::size_t kWidth = 24;
using Row = std::array<double, kWidth>;

template <class Run>
void add_part(double sum, const Run& run, Row& row) {
  for (std::size_t k = 0; k < Run::count; ++k) row[Run::first + k] += sum * run.at[k];
}

// A channel's sums with every unknown from that run on which it is for, `levels` saying whether dark and contrast are
// among the unknowns.
Row sums_with(const std::array<double, kChannels>& sums, const Derivatives& by, bool levels) {
  Row row{};
  if (levels) {
    add_part(sums[kOne], by.dark, row);
    add_part(sums[kLevel], by.contrast, row);
  }
  add_part(sums[kTone], by.tone, row);
  add_part(sums[kSlopeU], by.slope_u, row);
  add_part(sums[kSlopeV], by.slope_v, row);
  add_part(sums[kSpreadU], by.spread_u, row);
  add_part(sums[kSpreadV], by.spread_v, row);
  add_part(sums[kTwist], by.twist, row);
  return row;
}

// Adds a channel to the rows of its unknowns, from column kFrom on: whole vectors, of which what is left of the
// diagonal does not count.
template <std::size_t kFrom, class Run>
void add_channel(const Run& run, const Row& with, double residual, std::array<Row, kUnknowns>& rows,
                 FitVector& gradient) {
  for (std::size_t k = 0; k < Run::count; ++k) {
    const double factor = run.at[k];
    Row& row = rows[Run::first + k];
    for (std::size_t j = kFrom; j < kWidth; ++j) row[j] += factor * with[j];
    gradient[Run::first + k] += factor * residual;
  }
}

}  // namespace

void FitNormal::add(const FitPlace& where, const ChannelSums& integers, bool has_edges) {
  if (integers[0] == 0) return;
  Sums sums = scaled(integers);
  FitPlace place = where;
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
  } else {
    squares_ += sums[kResidual][kResidual];
  }
  const Derivatives by(place);
  const bool levels = tones_ == Tones::smooth;
  const auto add_to = [&](auto from, Channel channel, const auto& run) {
    const Row with = sums_with(sums[channel], by, levels);
    add_channel<decltype(from)::value>(run, with, sums[channel][kResidual], rows_, gradient_);
  };
  using FromStart = std::integral_constant<std::size_t, 0>;
  using FromTone = std::integral_constant<std::size_t, 8>;
  using FromBlur = std::integral_constant<std::size_t, 16>;
  if (levels) {
    add_to(FromStart(), kOne, by.dark);
    add_to(FromStart(), kLevel, by.contrast);
  }
  if (!has_edges) return;
  add_to(FromTone(), kTone, by.tone);
  add_to(FromTone(), kSlopeU, by.slope_u);
  add_to(FromTone(), kSlopeV, by.slope_v);
  add_to(FromBlur(), kSpreadU, by.spread_u);
  add_to(FromBlur(), kSpreadV, by.spread_v);
  add_to(FromBlur(), kTwist, by.twist);
}

void FitNormal::add_prior(const FitVector& factors, double value, double weight) {
  for (std::size_t i = 0; i < kUnknowns; ++i) {
    gradient_[i] -= weight * value * factors[i];
    for (std::size_t j = i; j < kUnknowns; ++j) rows_[i][j] += weight * factors[i] * factors[j];
  }
}

FitMatrix FitNormal::lower() const {
  FitMatrix lower;
  for (std::size_t i = 0; i < kUnknowns; ++i) {
    for (std::size_t j = i; j < kUnknowns; ++j) lower[j * kUnknowns + i] = rows_[i][j];
  }
  return lower;
}

bool FitNormal::solve_levels(FitVector& step) const {
  FitMatrix factor = lower();
  if (!factorise<kUnknowns>(factor, kLeastShare, kToneCurve)) return false;
  step = berth::solve<kUnknowns>(factor, gradient_, kToneCurve);
  for (std::size_t i = kToneCurve; i < kUnknowns; ++i) step[i] = 0;
  return true;
}

bool FitNormal::solve(FitVector& step, FitMatrix& factor) const {
  factor = lower();
  if (tones_ == Tones::local) {
    for (std::size_t i = 0; i < kToneCurve; ++i) factor[i * kUnknowns + i] = 1;  // held
  }
  if (!factorise<kUnknowns>(factor, kLeastShare)) return false;
  step = berth::solve<kUnknowns>(factor, gradient_);
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
