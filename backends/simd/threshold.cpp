#include <algorithm>
#include <cstring>

#include "reference/reference.hpp"
#include "simd/simd_ops.hpp"
#include "simd/workspace.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/threshold.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET != HWY_SCALAR

constexpr std::size_t kMargin = TileRow::kMargin;

// Sets row.limit to the least level that is not black: one above the cut, or 0 where the tiles' contrast does not
// suffice.
void find_limits(TileRow& row, const u8* const (&low)[3], const u8* const (&high)[3], std::size_t tiles, u8 contrast,
                 int cut) {
  const hn::ScalableTag<u8> bytes;
  const hn::Repartition<std::uint16_t, decltype(bytes)> shorts;
  const std::size_t lanes = hn::Lanes(bytes);
  for (std::size_t x = 0; x < tiles; x += lanes) {
    hn::StoreU(
        hn::Min(hn::Min(hn::LoadU(bytes, low[0] + x), hn::LoadU(bytes, low[1] + x)), hn::LoadU(bytes, low[2] + x)),
        bytes, row.low + kMargin + x);
    hn::StoreU(
        hn::Max(hn::Max(hn::LoadU(bytes, high[0] + x), hn::LoadU(bytes, high[1] + x)), hn::LoadU(bytes, high[2] + x)),
        bytes, row.high + kMargin + x);
  }
  row.low[kMargin - 1] = row.low[kMargin];
  row.high[kMargin - 1] = row.high[kMargin];
  row.low[kMargin + tiles] = row.low[kMargin + tiles - 1];
  row.high[kMargin + tiles] = row.high[kMargin + tiles - 1];
  const auto least_contrast = hn::Set(bytes, contrast);
  const auto one = hn::Set(bytes, u8{1});
  const auto factor = hn::Set(shorts, static_cast<std::uint16_t>(cut));
  const auto upper = hn::Set(shorts, std::uint16_t{0xff00});
  for (std::size_t x = 0; x < tiles; x += lanes) {
    const u8* l = row.low + kMargin + x;
    const u8* h = row.high + kMargin + x;
    const auto least = hn::Min(hn::Min(hn::LoadU(bytes, l - 1), hn::LoadU(bytes, l)), hn::LoadU(bytes, l + 1));
    const auto most = hn::Max(hn::Max(hn::LoadU(bytes, h - 1), hn::LoadU(bytes, h)), hn::LoadU(bytes, h + 1));
    const auto range = hn::Sub(most, least);
    const auto pairs = hn::BitCast(shorts, range);
    const auto even = hn::ShiftRight<8>(hn::Mul(hn::AndNot(upper, pairs), factor));
    const auto odd = hn::And(hn::Mul(hn::ShiftRight<8>(pairs), factor), upper);
    const auto limit = hn::Add(least, hn::BitCast(bytes, hn::Or(even, odd)));
    const auto judged = hn::Eq(hn::Max(range, least_contrast), range);
    hn::StoreU(hn::IfThenElseZero(judged, hn::Add(limit, one)), bytes, row.limit + kMargin + x);
  }
}

#endif  // HWY_TARGET != HWY_SCALAR

void threshold([[maybe_unused]] Workspace& workspace, const threshold_params& p, const u32* pixels, const u32* minima,
               const u32* maxima, const u32* levels, u32* bits) {
#if HWY_TARGET == HWY_SCALAR  // a processor without any vectors Highway knows
  reference::threshold(p, pixels, minima, maxima, levels, bits);
#else
  if (levels[3] == 0) {  // then the limit may be 255, and one above it no byte
    reference::threshold(p, pixels, minima, maxima, levels, bits);
    return;
  }
  const hn::CappedTag<u8, 32> bytes;
  const hn::Repartition<u32, decltype(bytes)> words;
  const hn::Rebind<u8, decltype(words)> tile_bytes;
  const std::size_t lanes = hn::Lanes(bytes);
  const std::size_t stride = static_cast<std::size_t>(p.row_words) * 32;
  const std::size_t tiles = stride / 4;
  const u32 last_mask = p.width % 32 == 0 ? ~0u : (1u << (p.width % 32)) - 1u;
  const auto spread = hn::Set(words, 0x01010101u);
  TileRow& row = workspace.tiles;
  for (int ty = 0; ty < p.tile_rows; ++ty) {
    const u8* low[3];
    const u8* high[3];
    for (int k = 0; k < 3; ++k) {
      const std::size_t y = static_cast<std::size_t>(std::min(std::max(ty + k - 1, 0), p.tile_rows - 1));
      low[k] = reinterpret_cast<const u8*>(minima) + y * tiles;
      high[k] = reinterpret_cast<const u8*>(maxima) + y * tiles;
    }
    find_limits(row, low, high, tiles, static_cast<u8>(levels[3]), p.cut);
    const int rows = std::min(4, p.height - ty * 4);
    const u8* line = reinterpret_cast<const u8*>(pixels) + static_cast<std::size_t>(ty) * 4 * stride;
    u8* out = reinterpret_cast<u8*>(bits + static_cast<std::size_t>(ty) * 4 * static_cast<std::size_t>(p.row_words));
    for (std::size_t x = 0; x < stride; x += lanes) {
      const auto tile_limits = hn::LoadU(tile_bytes, row.limit + kMargin + x / 4);
      const auto limits = hn::BitCast(bytes, hn::Mul(hn::PromoteTo(words, tile_limits), spread));
      for (int k = 0; k < rows; ++k) {
        const auto line_pixels = hn::LoadU(bytes, line + static_cast<std::size_t>(k) * stride + x);
        u8 mask[8];
        hn::StoreMaskBits(bytes, hn::Lt(line_pixels, limits), mask);
        std::memcpy(out + (static_cast<std::size_t>(k) * stride + x) / 8, mask, lanes / 8);
      }
    }
    for (int k = 0; k < rows; ++k) {
      bits[static_cast<std::size_t>((ty * 4 + k + 1) * p.row_words) - 1] &= last_mask;
    }
  }
#endif
}

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth::simd_backend {
BERTH_SIMD_DISPATCH(threshold,
                    (Workspace & workspace, const threshold_params& p, const u32* pixels, const u32* minima,
                     const u32* maxima, const u32* levels, u32* bits),
                    (workspace, p, pixels, minima, maxima, levels, bits))
}  // namespace berth::simd_backend
#endif
