#include <algorithm>
#include <cstring>

#include "simd/simd_ops.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/extract_window.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

/// Frame columns [from, to) that a window's columns cover, each with its weight; sums of columns wrap, their
/// differences do not.
struct Columns {
  u32 sums[kMaxExtractColumns];        // of the rows of one window row, weighted
  u32 before[kMaxExtractColumns + 1];  // sums[0] + … + sums[i - 1]
};

int clamped(int at, int length) { return std::clamp(at, 0, length - 1); }

/// Adds weight times a frame row's pixels to sums, from frame column `left` on; outside the frame its rim.
void add_row(const u8* row, int width, int left, int count, u32 weight, u32* sums) {
  const hn::ScalableTag<u32> d;
  const hn::Rebind<u8, decltype(d)> bytes;
  const int lanes = static_cast<int>(hn::Lanes(d));
  int i = 0;
  for (; i < count && left + i < 0; ++i) sums[i] += weight * row[0];
  const int inside = std::min(count, width - left);
  for (; i + lanes <= inside; i += lanes) {
    const auto pixels = hn::PromoteTo(d, hn::LoadU(bytes, row + left + i));
    hn::StoreU(hn::Add(hn::LoadU(d, sums + i), hn::Mul(pixels, hn::Set(d, weight))), d, sums + i);
  }
  for (; i < inside; ++i) sums[i] += weight * row[left + i];
  for (; i < count; ++i) sums[i] += weight * row[width - 1];
}

/// A window row whose pixels are the frame's.
void copy_row(const u8* row, int width, int left, int count, u8* out) {
  int i = 0;
  for (; i < count && left + i < 0; ++i) out[i] = row[0];
  const int inside = std::clamp(width - left, i, count);
  std::memcpy(out + i, row + left + i, static_cast<std::size_t>(inside - i));
  std::fill(out + inside, out + count, row[width - 1]);
}

/// floor((sum + area / 2) / area) for quotients of 255 at most: a float's estimate is off by one at most.
u8 mean(u32 sum, u32 area, float by_area) {
  const u32 all = sum + area / 2;
  u32 quotient = static_cast<u32>(static_cast<float>(all) * by_area);
  if (quotient * area > all) --quotient;
  if (all - quotient * area >= area) ++quotient;
  return static_cast<u8>(quotient);
}

}  // namespace

void extract_window(const extract_window_params& p, const u32* pixels, const s32* windows, u32* out_pixels, int first,
                    int last) {
  Columns columns;
  const int out_width = p.out_words * 4;
  const u8* frame = reinterpret_cast<const u8*>(pixels);
  for (int out_row = first; out_row < last; ++out_row) {
    const s32* window = windows + out_row / p.out_height * 4;
    const int step = std::clamp(window[2], 256, 2560);
    const int left = window[0];
    const int top = window[1] + out_row % p.out_height * step;
    u8* out = reinterpret_cast<u8*>(out_pixels) + static_cast<std::ptrdiff_t>(out_row) * out_width;
    const auto row_at = [&](int y) {
      return frame + static_cast<std::ptrdiff_t>(clamped(y, p.height)) * p.row_words * 4;
    };
    if (step == 256 && (left & 255) == 0 && (top & 255) == 0) {
      copy_row(row_at(top >> 8), p.width, left >> 8, out_width, out);
      continue;
    }
    const int from_x = left >> 8;
    const int count = ((left + out_width * step - 1) >> 8) - from_x + 1;
    std::fill_n(columns.sums, count, 0u);
    for (int y = top >> 8; y <= (top + step - 1) >> 8; ++y) {
      const int weight = std::min(top + step, y * 256 + 256) - std::max(top, y * 256);
      add_row(row_at(y), p.width, from_x, count, static_cast<u32>(weight), columns.sums);
    }
    columns.before[0] = 0;
    for (int i = 0; i < count; ++i) columns.before[i + 1] = columns.before[i] + columns.sums[i];
    const u32 area = static_cast<u32>(step) * static_cast<u32>(step);
    const float by_area = 1.0F / static_cast<float>(area);
    for (int i = 0; i < out_width; ++i) {
      const int low = left + i * step;
      const int high = low + step;
      const int a = (low >> 8) - from_x;  // wholly or partly covered: a to b
      const int b = ((high - 1) >> 8) - from_x;
      const u32 cut_a = static_cast<u32>(low & 255);
      const u32 cut_b = static_cast<u32>(-high & 255);
      const u32 sum =
          256u * (columns.before[b + 1] - columns.before[a]) - cut_a * columns.sums[a] - cut_b * columns.sums[b];
      out[i] = mean(sum, area, by_area);
    }
  }
}

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth::simd_backend {
BERTH_SIMD_DISPATCH(extract_window,
                    (const extract_window_params& p, const u32* pixels, const s32* windows, u32* out_pixels, int first,
                     int last),
                    (p, pixels, windows, out_pixels, first, last))
}  // namespace berth::simd_backend
#endif
