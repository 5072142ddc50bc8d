// Points of a map sampled, a vector of them at a time: each by the same operations as alone, so the same bits.
#include <cstring>

#include "target/sample.hpp"
#include "target/sample_points.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "target/sample_simd.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace berth::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// Where every point lies; then its four pixels as the bytes of a word (scalars load them, in a pass of their own: words
// stored one by one cannot be loaded as a vector right away); then what lies between them.
void sample_block(View2D<const u8> image, const QuadMap& map, const double* u, const double* v, int n,
                  PointSamples& samples) {
  const hn::CappedTag<double, 4> d;
  const hn::Rebind<s32, decltype(d)> ints;
  const int lanes = static_cast<int>(hn::Lanes(d));
  const auto one = hn::Set(d, 1);
  const auto zero = hn::Zero(d);
  const auto half = hn::Set(d, -0.5);
  const auto x_end = hn::Set(d, image.width - 0.5);
  const auto y_end = hn::Set(d, image.height - 0.5);
  const auto x_last = hn::Set(d, image.width - 1);
  const auto y_last = hn::Set(d, image.height - 1);
  const auto ix_last = hn::Set(ints, image.width - 2);
  const auto iy_last = hn::Set(ints, image.height - 2);
  const auto stride = hn::Set(ints, static_cast<s32>(image.stride));
  s32 at[kMaxPoints];
  double along[kMaxPoints];
  double down[kMaxPoints];
  for (int i = 0; i < n; i += lanes) {
    const auto pu = hn::LoadU(d, u + i);
    const auto pv = hn::LoadU(d, v + i);
    const auto at_map = [&](double a, double b, double c) HWY_ATTR {
      return hn::Add(hn::Add(hn::Mul(hn::Set(d, a), pu), hn::Mul(hn::Set(d, b), pv)), hn::Set(d, c));
    };
    const auto z = hn::Div(one, at_map(map.gz, map.hz, 1));
    auto x = hn::Mul(at_map(map.ax, map.bx, map.cx), z);
    auto y = hn::Mul(at_map(map.ay, map.by, map.cy), z);
    const auto inside = hn::And(hn::And(hn::Gt(x, half), hn::Gt(y, half)), hn::And(hn::Lt(x, x_end), hn::Lt(y, y_end)));
    if (hn::AllTrue(d, inside)) {
      std::memset(samples.inside + i, 1, static_cast<std::size_t>(lanes));
    } else {
      u8 bits[8] = {};
      hn::StoreMaskBits(d, inside, bits);
      for (int k = 0; k < lanes; ++k) samples.inside[i + k] = (bits[0] >> k & 1) != 0;
      x = hn::IfThenElseZero(inside, x);
      y = hn::IfThenElseZero(inside, y);
    }
    x = hn::Min(hn::Max(x, zero), x_last);
    y = hn::Min(hn::Max(y, zero), y_last);
    const auto ix = hn::Min(hn::DemoteTo(ints, x), ix_last);
    const auto iy = hn::Min(hn::DemoteTo(ints, y), iy_last);
    hn::StoreU(hn::Sub(x, hn::PromoteTo(d, ix)), d, along + i);
    hn::StoreU(hn::Sub(y, hn::PromoteTo(d, iy)), d, down + i);
    hn::StoreU(hn::Add(hn::Mul(iy, stride), ix), ints, at + i);
  }
  s32 pixels[kMaxPoints];
  for (int i = 0; i < n; ++i) {
    std::uint16_t above, below;
    std::memcpy(&above, image.data + at[i], 2);
    std::memcpy(&below, image.data + at[i] + image.stride, 2);
    pixels[i] = static_cast<s32>(above | static_cast<u32>(below) << 16);
  }
  const auto byte = hn::Set(ints, 255);
  for (int i = 0; i < n; i += lanes) {
    const auto word = hn::LoadU(ints, pixels + i);
    const auto fx = hn::LoadU(d, along + i);
    const auto fy = hn::LoadU(d, down + i);
    const auto upper = hn::PromoteTo(d, hn::And(word, byte));
    const auto upper_right = hn::PromoteTo(d, hn::And(hn::ShiftRight<8>(word), byte));
    const auto lower = hn::PromoteTo(d, hn::And(hn::ShiftRight<16>(word), byte));
    const auto lower_right = hn::PromoteTo(d, hn::And(hn::ShiftRight<24>(word), byte));
    const auto top = hn::Add(upper, hn::Mul(hn::Sub(upper_right, upper), fx));
    const auto bottom = hn::Add(lower, hn::Mul(hn::Sub(lower_right, lower), fx));
    hn::StoreU(hn::Add(top, hn::Mul(hn::Sub(bottom, top), fy)), d, samples.value + i);
  }
}

}  // namespace berth::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth {

HWY_EXPORT(sample_block);

void sample_points(View2D<const u8> image, const QuadMap& map, const double* u, const double* v, int n,
                   PointSamples& samples) {
  int vectors = n / 4 * 4;
  if (image.width < 2 || image.height < 2) vectors = 0;
  if (vectors > 0) HWY_DYNAMIC_DISPATCH(sample_block)(image, map, u, v, vectors, samples);
  for (int i = vectors; i < n; ++i) {
    double x, y;
    map.at(u[i], v[i], x, y);
    samples.inside[i] = sample(image, x, y, samples.value[i]);
  }
  for (int i = 0; i < n; ++i) {
    if (!samples.inside[i]) samples.value[i] = 0;
  }
}

}  // namespace berth
#endif
