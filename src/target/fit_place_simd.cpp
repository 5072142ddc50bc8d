// A place's sums into the equations. Rows are whole vectors, every element by the same products and sums in the same
// order, so that instruction sets differ in how many they do at once alone.
#include <algorithm>
#include <initializer_list>

#include "target/fit_normal.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "target/fit_place_simd.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace berth::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

// A place has levels of its own to tell where its pattern varies by this much (variance of P), and its contrast is not
// taken as less than this, grey levels.
constexpr double kLeastVariance = 0.02;
constexpr double kLeastContrast = 2;

constexpr double kQ11 = 1 / 2048.0, kQ4 = 1 / 16.0;
constexpr std::array<double, kChannels> kUnit = {1, kQ11, kQ11, kQ11, kQ11, kQ11, kQ11, kQ11, kQ4};

using Sums = std::array<std::array<double, kChannels>, kChannels>;

// The upper triangle, row by row, padded to whole vectors; the sum of channels c <= d is at place_in(c) + d.
using Triangle = std::array<double, 48>;
constexpr std::size_t place_in(std::size_t c) { return c * kChannels - c * (c + 1) / 2; }

constexpr Triangle units() {
  Triangle result{};
  for (std::size_t c = 0; c < kChannels; ++c) {
    for (std::size_t d = c; d < kChannels; ++d) result[place_in(c) + d] = kUnit[c] * kUnit[d];
  }
  return result;
}

HWY_INLINE void scale(const PlaceSums& integers, Triangle& sums) {
  alignas(64) static constexpr Triangle kUnits = units();
  const hn::CappedTag<double, 8> d;
  const hn::Rebind<std::int32_t, decltype(d)> ints;
  static_assert(PlaceSums::kRows >= kUnits.size(), "what is loaded exists");
  for (std::size_t k = 0; k < kUnits.size(); k += hn::Lanes(d)) {
    const auto totals = hn::PromoteTo(d, hn::LoadU(ints, integers.rows.data() + k));
    hn::Store(hn::Mul(totals, hn::Load(d, kUnits.data() + k)), d, sums.data() + k);
  }
}

Sums whole(const Triangle& triangle) {
  Sums sums;
  for (std::size_t c = 0; c < kChannels; ++c) {
    for (std::size_t d = c; d < kChannels; ++d) sums[c][d] = sums[d][c] = triangle[place_in(c) + d];
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

constexpr std::size_t kWidth = FitEquations::kWidth;
using Row = FitEquations::Row;

// Derivatives of the model by the unknowns, a row for each channel; the residual stands for itself behind them.
struct Derivatives {
  explicit Derivatives(const FitPlace& p) {
    const double x = p.x, y = p.y, a = p.a, b = p.b;
    // A pattern that moves by d shows at a place what was d before it: minus the slope.
    const double u = -p.contrast * p.steep_u, v = -p.contrast * p.steep_v;
    set(kOne, kDark, {1, x, y});
    set(kLevel, kContrast, {1, x, y, x * x, x * y, y * y});
    set(kTone, kToneCurve, {p.contrast});
    set(kSlopeU, kField, {u, u * a, u * b, 0, 0, 0, u * a * a, u * a * b});
    set(kSlopeV, kField, {0, 0, 0, v, v * a, v * b, v * a * b, v * b * b});
    const auto blur = [&](Channel channel, double times, const std::array<double, 3>& one) {
      set(channel, kBlur, {times * one[0], times * one[1], times * one[2]});
    };
    blur(kSpreadU, -p.contrast, p.wider_u);
    blur(kSpreadV, -p.contrast, p.wider_v);
    blur(kTwist, p.contrast, p.twist);
    set(kResidual, FitEquations::kGradient, {1});
  }

  alignas(64) std::array<Row, kChannels> by = {};

 private:
  void set(Channel channel, std::size_t first, std::initializer_list<double> values) {
    std::copy(values.begin(), values.end(), by[channel].begin() + static_cast<std::ptrdiff_t>(first));
  }
};

using D = hn::CappedTag<double, 8>;
using V = hn::Vec<D>;
constexpr std::size_t kLanes = hn::MaxLanes(D());

// The first and the last channel that depend on each eight of the unknowns.
constexpr std::size_t kEight = 8;
constexpr std::size_t kFirstOf[kWidth / kEight] = {kOne, kLevel, kSlopeU};
constexpr std::size_t kLastOf[kWidth / kEight] = {kLevel, kSlopeV, kResidual};

// Sums of two channels.
struct ByTriangle {
  const Triangle& sums;
  double operator()(std::size_t c, std::size_t d) const { return sums[c < d ? place_in(c) + d : place_in(d) + c]; }
};
struct ByRows {
  const Sums& sums;
  double operator()(std::size_t c, std::size_t d) const { return sums[c][d]; }
};

// Adds a channel to the rows of its unknowns, columns from kFrom on: whole vectors, of which what is left of the
// diagonal does not count. Nor do channels before kFirst, which depend on unknowns left of it alone.
template <std::size_t kFrom, std::size_t kFirst, class SumOf>
HWY_INLINE void add_channel(std::size_t channel, std::initializer_list<std::size_t> unknowns, SumOf sum_of,
                            const Derivatives& derivatives, FitEquations& equations) {
  const D d;
  V with[(kWidth - kFrom) / kLanes];
  for (std::size_t i = 0; i < (kWidth - kFrom) / kLanes; ++i) {
    const std::size_t eight = (kFrom + i * kLanes) / kEight;
    with[i] = hn::Zero(d);
    for (std::size_t c = std::max(kFirst, kFirstOf[eight]); c <= kLastOf[eight]; ++c) {
      const V by = hn::Load(d, derivatives.by[c].data() + kFrom + i * kLanes);
      with[i] = hn::Add(with[i], hn::Mul(hn::Set(d, sum_of(channel, c)), by));
    }
  }
  for (const std::size_t k : unknowns) {
    const V factor = hn::Set(d, derivatives.by[channel][k]);
    double* const row = equations.rows[k].data() + kFrom;
    for (std::size_t i = 0; i < (kWidth - kFrom) / kLanes; ++i) {
      hn::Store(hn::Add(hn::Load(d, row + i * kLanes), hn::Mul(factor, with[i])), d, row + i * kLanes);
    }
  }
}

template <class SumOf>
HWY_INLINE void add_edges(SumOf sum_of, const Derivatives& by, FitEquations& equations) {
  add_channel<8, kTone>(kTone, {kToneCurve}, sum_of, by, equations);
  constexpr std::size_t f = kField;
  add_channel<8, kSlopeU>(kSlopeU, {f, f + 1, f + 2, f + 6, f + 7}, sum_of, by, equations);
  add_channel<8, kSlopeU>(kSlopeV, {f + 3, f + 4, f + 5, f + 6, f + 7}, sum_of, by, equations);
  for (const std::size_t channel : {kSpreadU, kSpreadV, kTwist}) {
    add_channel<16, kSpreadU>(channel, {kBlur, kBlur + 1, kBlur + 2}, sum_of, by, equations);
  }
}

}  // namespace

void add_place(const FitPlace& where, const PlaceSums& integers, Tones tones, FitEquations& equations) {
  const bool has_edges = integers.rows[PlaceSums::kOnEdges] > 0;
  alignas(64) Triangle sums;
  scale(integers, sums);
  if (tones == Tones::local) {
    Sums left = whole(sums);
    eliminate(kOne, kLevel, left);
    const double variance = left[kLevel][kLevel];
    const bool tells = has_edges && variance >= kLeastVariance * left[kOne][kOne];
    FitPlace place = where;
    if (tells) {
      place.contrast = std::max(kLeastContrast, place.contrast + left[kLevel][kResidual] / variance);
      eliminate(kLevel, kTone, left);
    }
    equations.squares += left[kResidual][kResidual];
    // Elimination rounds the two halves apart: the rows it wrote count.
    if (tells) add_edges(ByRows{left}, Derivatives(place), equations);
    return;
  }
  const ByTriangle sum_of{sums};
  equations.squares += sum_of(kResidual, kResidual);
  const Derivatives by(where);
  add_channel<0, kOne>(kOne, {0, 1, 2}, sum_of, by, equations);
  add_channel<0, kLevel>(kLevel, {3, 4, 5, 6, 7, 8}, sum_of, by, equations);
  if (has_edges) add_edges(sum_of, by, equations);
}

}  // namespace berth::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth {
HWY_EXPORT(add_place);
void FitNormal::add(const FitPlace& place, const PlaceSums& sums) {
  constexpr std::size_t kOneByOne = 0;  // pixels of this place, of which a block's quarter may have none
  if (sums.rows[kOneByOne] > 0) HWY_DYNAMIC_DISPATCH(add_place)(place, sums, tones_, equations_);
}
}  // namespace berth
#endif
