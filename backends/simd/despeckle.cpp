#include <algorithm>

#include "simd/simd_ops.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/despeckle.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

#include "simd/bit_rows-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {

// The last vector of a row reaches past it, where the next rows will be written; so the last rows are written elsewhere
// first.
void despeckle(const despeckle_params& p, const u32* bits, u32* clean) {
  const RowTag words;
  const int lanes = row_lanes();
  const int row_words = p.row_words;
  const int height = p.height;
  u32 aside[kMaxRowWords + kRowSlack];
  for (int y = 0; y < height; ++y, bits += row_words, clean += row_words) {
    // Beyond the first and the last row lies white; the row itself is masked out below.
    const u32* above = y > 0 ? bits - row_words : bits;
    const u32* below = y + 1 < height ? bits + row_words : bits;
    const auto above_mask = hn::Set(words, y > 0 ? ~0u : 0u);
    const auto below_mask = hn::Set(words, y + 1 < height ? ~0u : 0u);
    u32* const out = (height - 1 - y) * row_words >= lanes ? clean : aside;
    RightMover right;
    for (int x = 0; x < row_words; x += lanes) {
      const auto here = row_words_at(bits, x, row_words);
      const auto left = hn::Or(hn::ShiftRight<1>(here), hn::ShiftLeft<31>(row_words_at(bits, x + 1, row_words)));
      const auto up = hn::And(hn::LoadU(words, above + x), above_mask);
      const auto down = hn::And(hn::LoadU(words, below + x), below_mask);
      hn::StoreU(hn::And(here, hn::Or(hn::Or(left, right.moved(here)), hn::Or(up, down))), words, out + x);
    }
    if (out == aside) std::copy(aside, aside + row_words, clean);
  }
}

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth::simd_backend {
BERTH_SIMD_DISPATCH(despeckle, (const despeckle_params& p, const u32* bits, u32* clean), (p, bits, clean))
}  // namespace berth::simd_backend
#endif
