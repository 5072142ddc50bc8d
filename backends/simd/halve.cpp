#include <algorithm>

#include "simd/simd_ops.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/halve.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void halve(const halve_params& p, const u32* pixels, u32* half_pixels) {
  const hn::ScalableTag<u32> words;
  const std::size_t lanes = hn::Lanes(words);
  const std::size_t stride = static_cast<std::size_t>(p.row_words);
  const std::size_t half_stride = static_cast<std::size_t>(p.half_row_words);
  const auto even_bytes = hn::Set(words, 0x00ff00ffu);
  const auto two = hn::Set(words, 0x00020002u);
  for (int half_y = 0; half_y < p.half_rows; ++half_y) {
    const u32* upper = pixels + static_cast<std::size_t>(std::min(half_y * 2, p.rows - 2)) * stride;
    const u32* lower = upper + stride;
    u8* out = reinterpret_cast<u8*>(half_pixels + static_cast<std::size_t>(half_y) * half_stride);
    std::size_t x = 0;
    for (; x + lanes <= stride; x += lanes) {  // two means a word
      const auto a = hn::LoadU(words, upper + x);
      const auto b = hn::LoadU(words, lower + x);
      const auto sums = hn::Add(hn::Add(hn::And(a, even_bytes), hn::And(hn::ShiftRight<8>(a), even_bytes)),
                                hn::Add(hn::And(b, even_bytes), hn::And(hn::ShiftRight<8>(b), even_bytes)));
      const auto means = hn::And(hn::ShiftRight<2>(hn::Add(sums, two)), even_bytes);
      const auto pairs = hn::Or(means, hn::ShiftRight<8>(means));
#if HWY_TARGET == HWY_SCALAR
      const std::uint16_t pair = static_cast<std::uint16_t>(hn::GetLane(pairs));
      std::copy_n(reinterpret_cast<const u8*>(&pair), 2, out + x * 2);
#else
      const hn::Rebind<std::uint16_t, decltype(words)> halves;
      hn::StoreU(hn::TruncateTo(halves, pairs), halves, reinterpret_cast<std::uint16_t*>(out + x * 2));
#endif
    }
    for (; x < stride; ++x) {
      const u8* a = reinterpret_cast<const u8*>(upper + x);
      const u8* b = reinterpret_cast<const u8*>(lower + x);
      out[x * 2] = static_cast<u8>((a[0] + a[1] + b[0] + b[1] + 2) / 4);
      out[x * 2 + 1] = static_cast<u8>((a[2] + a[3] + b[2] + b[3] + 2) / 4);
    }
    std::fill(out + stride * 2, out + half_stride * 4, out[stride * 2 - 1]);
  }
}

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth::simd_backend {
BERTH_SIMD_DISPATCH(halve, (const halve_params& p, const u32* pixels, u32* half_pixels), (p, pixels, half_pixels))
}  // namespace berth::simd_backend
#endif
