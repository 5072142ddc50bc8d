#include "reference/reference.hpp"
#include "simd/simd_ops.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/tile_extrema.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

#include "tile_extrema-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

// padded_width is a multiple of 32, so 32 bytes divide every row.
void tile_extrema(const tile_extrema_params& p, const u32* pixels, u32* minima, u32* maxima) {
#if HWY_TARGET == HWY_SCALAR  // a processor without any vectors Highway knows
  reference::tile_extrema(p, pixels, minima, maxima);
#else
  const hn::CappedTag<u8, 32> bytes;
  const hn::Repartition<u32, decltype(bytes)> words;
  const hn::Rebind<u8, decltype(words)> tiles;
  const std::size_t stride = static_cast<std::size_t>(p.row_words) * 16;
  const u8* row = reinterpret_cast<const u8*>(pixels);
  u8* low = reinterpret_cast<u8*>(minima);
  u8* high = reinterpret_cast<u8*>(maxima);
  for (int y = 0; y < p.tile_rows; ++y, row += 4 * stride) {
    for (std::size_t x = 0; x < stride; x += hn::Lanes(bytes)) {
      const auto a = hn::LoadU(bytes, row + x);
      const auto b = hn::LoadU(bytes, row + x + stride);
      const auto c = hn::LoadU(bytes, row + x + stride * 2);
      const auto d = hn::LoadU(bytes, row + x + stride * 3);
      berth::HWY_NAMESPACE::store_tile_extrema(bytes, a, b, c, d, low, high);
      low += hn::Lanes(tiles);
      high += hn::Lanes(tiles);
    }
  }
#endif
}

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth::simd_backend {
BERTH_SIMD_DISPATCH(tile_extrema, (const tile_extrema_params& p, const u32* pixels, u32* minima, u32* maxima),
                    (p, pixels, minima, maxima))
}  // namespace berth::simd_backend
#endif
