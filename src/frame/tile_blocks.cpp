#include "frame/tile_blocks.hpp"

#include <hwy/cache_control.h>

#include <algorithm>

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "frame/tile_blocks.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

#include "tile_extrema-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace berth::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

#if HWY_TARGET == HWY_SCALAR  // a processor without any vectors Highway knows

u8 pixel_at(int scale, const u8* pixels, std::ptrdiff_t stride, int x, int y) {
  if (scale == 1) return pixels[y * stride + x];
  const u8* at = pixels + 2 * y * stride + 2 * x;
  return static_cast<u8>((at[0] + at[1] + at[stride] + at[stride + 1] + 2) / 4);
}

void block_extrema(int scale, const u8* pixels, std::ptrdiff_t stride, int count, int step, u8* minima, u8* maxima) {
  for (int i = 0; i < count; ++i, pixels += step, minima += 4, maxima += 4) {
    std::fill(minima, minima + 4, u8{255});
    std::fill(maxima, maxima + 4, u8{0});
    for (int y = 0; y < kBlockHeight; ++y) {
      for (int x = 0; x < kBlockWidth; ++x) {
        const u8 pixel = pixel_at(scale, pixels, stride, x, y);
        minima[x / 4] = std::min(minima[x / 4], pixel);
        maxima[x / 4] = std::max(maxima[x / 4], pixel);
      }
    }
  }
}

std::size_t count_up_to(const u8* values, std::size_t count, u8 most) {
  return static_cast<std::size_t>(std::count_if(values, values + count, [&](u8 value) { return value <= most; }));
}

#else

using Bytes = hn::FixedTag<u8, 16>;
using Row = hn::Vec<Bytes>;

/// Row y of a block of the image.
HWY_INLINE Row row_of(std::ptrdiff_t stride, const u8* pixels, int y) {
  return hn::LoadU(Bytes(), pixels + y * stride);
}

/// Row y of a block of the halved image: sums of 2 × 2 in 16 bits.
HWY_INLINE Row halved_row_of(std::ptrdiff_t stride, const u8* pixels, int y) {
  const Bytes bytes;
  const hn::FixedTag<std::uint16_t, 8> pairs;
  const auto even = hn::Set(pairs, 0x00ff);
  const auto half = [&](const u8* upper) HWY_ATTR {
    const auto a = hn::BitCast(pairs, hn::LoadU(bytes, upper));
    const auto b = hn::BitCast(pairs, hn::LoadU(bytes, upper + stride));
    const auto sums =
        hn::Add(hn::Add(hn::And(a, even), hn::ShiftRight<8>(a)), hn::Add(hn::And(b, even), hn::ShiftRight<8>(b)));
    return hn::ShiftRight<2>(hn::Add(sums, hn::Set(pairs, 2)));
  };
  const u8* const upper = pixels + 2 * y * stride;
  return hn::Combine(bytes, hn::TruncateTo(hn::Half<Bytes>(), half(upper + 16)),
                     hn::TruncateTo(hn::Half<Bytes>(), half(upper)));
}

template <class Get>
HWY_INLINE void extrema_of(const Get& row, u8* minima, u8* maxima) {
  store_tile_extrema(Bytes(), row(0), row(1), row(2), row(3), minima, maxima);
}

void block_extrema(int scale, const u8* pixels, std::ptrdiff_t stride, int count, int step, u8* minima, u8* maxima) {
  for (int i = 0; i < count; ++i, pixels += step, minima += 4, maxima += 4) {
    // The next row of blocks: too far apart for the processor to guess.
    for (int y = 4 * scale; y < 8 * scale; ++y) hwy::Prefetch(pixels + y * stride);
    if (scale == 1) {
      extrema_of([&](int y) HWY_ATTR { return row_of(stride, pixels, y); }, minima, maxima);
    } else {
      extrema_of([&](int y) HWY_ATTR { return halved_row_of(stride, pixels, y); }, minima, maxima);
    }
  }
}

std::size_t count_up_to(const u8* values, std::size_t count, u8 most) {
  const hn::ScalableTag<u8> bytes;
  const std::size_t lanes = hn::Lanes(bytes);
  const auto limit = hn::Set(bytes, most);
  std::size_t found = 0;
  std::size_t i = 0;
  for (; i + lanes <= count; i += lanes) {
    const auto value = hn::LoadU(bytes, values + i);
    found += hn::CountTrue(bytes, hn::Eq(hn::Min(value, limit), value));
  }
  for (; i < count; ++i) found += values[i] <= most ? 1 : 0;
  return found;
}

#endif

}  // namespace
}  // namespace berth::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth {
HWY_EXPORT(block_extrema);
HWY_EXPORT(count_up_to);

void block_extrema(int scale, const u8* pixels, std::ptrdiff_t stride, int count, int step, u8* minima, u8* maxima) {
  HWY_DYNAMIC_DISPATCH(block_extrema)(scale, pixels, stride, count, step, minima, maxima);
}
std::size_t count_up_to(const u8* values, std::size_t count, u8 most) {
  return HWY_DYNAMIC_DISPATCH(count_up_to)(values, count, most);
}
}  // namespace berth
#endif
