// A place's sums into the equations. Rows are whole vectors, every element by the same products and sums in the same
// order, so that instruction sets differ in how many they do at once alone.
#include <algorithm>
#include <type_traits>

#include "target/fit_normal.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "target/fit_place_simd.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace berth::HWY_NAMESPACE {
namespace {

// A place has levels of its own to tell where its pattern varies by this much (variance of P), and its contrast is not
// taken as less than this, grey levels.
constexpr double kLeastVariance = 0.02;
constexpr double kLeastContrast = 2;

constexpr double kQ11 = 1 / 2048.0, kQ4 = 1 / 16.0;
constexpr std::array<double, kChannels> kUnit = {1, kQ11, kQ11, kQ11, kQ11, kQ11, kQ11, kQ11, kQ4};

using Sums = std::array<std::array<double, kChannels>, kChannels>;

Sums scaled(const PlaceSums& integers) {
  Sums sums;
  std::size_t k = 0;
  for (std::size_t c = 0; c < kChannels; ++c) {
    for (std::size_t d = c; d < kChannels; ++d, ++k)
      sums[c][d] = sums[d][c] = integers.total(k) * (kUnit[c] * kUnit[d]);
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

constexpr std::size_t kWidth = FitEquations::kWidth;
using Row = FitEquations::Row;

template <class Run>
HWY_INLINE void add_part(double sum, const Run& run, Row& row) {
  for (std::size_t k = 0; k < Run::count; ++k) row[Run::first + k] += sum * run.at[k];
}

// A channel's sums with every unknown from that run on which it is for, `levels` saying whether dark and contrast are
// among the unknowns.
HWY_INLINE Row sums_with(const std::array<double, kChannels>& sums, const Derivatives& by, bool levels) {
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
HWY_INLINE void add_channel(const Run& run, const Row& with, double residual, FitEquations& equations) {
  for (std::size_t k = 0; k < Run::count; ++k) {
    const double factor = run.at[k];
    Row& row = equations.rows[Run::first + k];
    for (std::size_t j = kFrom; j < kWidth; ++j) row[j] += factor * with[j];
    equations.gradient[Run::first + k] += factor * residual;
  }
}

}  // namespace

void add_place(const FitPlace& where, const PlaceSums& integers, Tones tones, FitEquations& equations) {
  const bool has_edges = integers.total(PlaceSums::kOnEdges) > 0;
  Sums sums = scaled(integers);
  FitPlace place = where;
  if (tones == Tones::local) {
    eliminate(kOne, kLevel, sums);
    const double variance = sums[kLevel][kLevel];
    const bool tells = has_edges && variance >= kLeastVariance * sums[kOne][kOne];
    if (tells) {
      place.contrast = std::max(kLeastContrast, place.contrast + sums[kLevel][kResidual] / variance);
      eliminate(kLevel, kTone, sums);
    }
    equations.squares += sums[kResidual][kResidual];
    if (!tells) return;
  } else {
    equations.squares += sums[kResidual][kResidual];
  }
  const Derivatives by(place);
  const bool levels = tones == Tones::smooth;
  const auto add_to = [&](auto from, Channel channel, const auto& run) {
    const Row with = sums_with(sums[channel], by, levels);
    add_channel<decltype(from)::value>(run, with, sums[channel][kResidual], equations);
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

}  // namespace berth::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth {
HWY_EXPORT(add_place);
void FitNormal::add(const FitPlace& place, const PlaceSums& sums) {
  constexpr std::size_t kOneByOne = 0;  // pixels of this place, of which a block's quarter may have none
  if (sums.total(kOneByOne) > 0) HWY_DYNAMIC_DISPATCH(add_place)(place, sums, tones_, equations_);
}
}  // namespace berth
#endif
