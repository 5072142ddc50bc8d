#include <algorithm>

#include "simd/simd_ops.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/normalize_window.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void normalize_window(const normalize_window_params& p, const u32* pixels, const s32* statistics, u32* tensor) {
  const hn::ScalableTag<s32> d;
  const hn::Rebind<u8, decltype(d)> bytes;
  const hn::Rebind<signed char, decltype(d)> signed_bytes;
  const std::size_t lanes = hn::Lanes(d);
  const std::size_t each = static_cast<std::size_t>(p.words) * 4;
  for (std::size_t window = 0; window < static_cast<std::size_t>(p.count); ++window) {
    const s32 mean = statistics[window * 2];
    const s32 gain = statistics[window * 2 + 1];
    const u8* from = reinterpret_cast<const u8*>(pixels) + window * each;
    signed char* to = reinterpret_cast<signed char*>(tensor) + window * each;
    std::size_t i = 0;
    for (; i + lanes <= each; i += lanes) {
      const auto off = hn::Sub(hn::PromoteTo(d, hn::LoadU(bytes, from + i)), hn::Set(d, mean));
      const auto scaled = hn::ShiftRight<8>(hn::Add(hn::Mul(off, hn::Set(d, gain)), hn::Set(d, 128)));
      hn::StoreU(hn::DemoteTo(signed_bytes, scaled), signed_bytes, to + i);  // saturates
    }
    for (; i < each; ++i) {
      to[i] = static_cast<signed char>(std::clamp(((from[i] - mean) * gain + 128) >> 8, -128, 127));
    }
  }
}

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth::simd_backend {
BERTH_SIMD_DISPATCH(normalize_window,
                    (const normalize_window_params& p, const u32* pixels, const s32* statistics, u32* tensor),
                    (p, pixels, statistics, tensor))
}  // namespace berth::simd_backend
#endif
