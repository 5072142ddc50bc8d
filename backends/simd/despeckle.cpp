#include "simd/simd_ops.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/despeckle.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void despeckle(const despeckle_params& p, const u32* bits, u32* clean) {
  const hn::ScalableTag<u32> words;
  const int lanes = static_cast<int>(hn::Lanes(words));
  for (int y = 0; y < p.height; ++y) {
    const u32* here = bits + static_cast<std::ptrdiff_t>(y) * p.row_words;
    // Beyond the first and the last row lies white; the row itself is masked out below.
    const u32* above = y > 0 ? here - p.row_words : here;
    const u32* below = y + 1 < p.height ? here + p.row_words : here;
    const u32 has_above = y > 0 ? ~0u : 0u;
    const u32 has_below = y + 1 < p.height ? ~0u : 0u;
    u32* out = clean + static_cast<std::ptrdiff_t>(y) * p.row_words;
    const auto scalar = [&](int x) {
      const u32 left = x > 0 ? here[x - 1] >> 31 : 0u;
      const u32 right = x + 1 < p.row_words ? here[x + 1] << 31 : 0u;
      out[x] =
          here[x] & ((here[x] << 1) | left | (here[x] >> 1) | right | (above[x] & has_above) | (below[x] & has_below));
    };
    scalar(0);
    int x = 1;
    for (; x + lanes < p.row_words; x += lanes) {
      const auto v = hn::LoadU(words, here + x);
      const auto left = hn::Or(hn::ShiftLeft<1>(v), hn::ShiftRight<31>(hn::LoadU(words, here + x - 1)));
      const auto right = hn::Or(hn::ShiftRight<1>(v), hn::ShiftLeft<31>(hn::LoadU(words, here + x + 1)));
      const auto up = hn::And(hn::LoadU(words, above + x), hn::Set(words, has_above));
      const auto down = hn::And(hn::LoadU(words, below + x), hn::Set(words, has_below));
      hn::StoreU(hn::And(v, hn::Or(hn::Or(left, right), hn::Or(up, down))), words, out + x);
    }
    for (; x < p.row_words; ++x) scalar(x);
  }
}

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth::simd_backend {
BERTH_SIMD_DISPATCH(despeckle, (const despeckle_params& p, const u32* bits, u32* clean), (p, bits, clean))
}  // namespace berth::simd_backend
#endif
