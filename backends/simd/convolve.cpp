#include <algorithm>
#include <array>
#include <cstring>

#include "simd/simd_ops.hpp"

// Vectors are members of structures here, which those of run-time size cannot be.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/convolve.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

#include "simd/dot-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

/// The rows under one row of outputs, with their padding.
using Rows = std::array<u32, kMaxConvolveWords>;

struct Window {
  const u32* rows;     // [kernel_height, row_words], padding included
  std::size_t stride;  // row_words
  bool has_negative;
};

/// Copies the rows that out_tensor row y of tensor n reads.
Window gather(const convolve_params& p, const u32* tensor, int n, int y, Rows& rows) {
  const std::size_t words = static_cast<std::size_t>(p.words);
  const std::size_t width = static_cast<std::size_t>(p.width) * words;
  const std::size_t pad = static_cast<std::size_t>(p.pad_x) * words;
  const std::size_t stride = width + 2 * pad;
  u32 any = 0;
  for (int ky = 0; ky < p.kernel_height; ++ky) {
    u32* to = rows.data() + static_cast<std::size_t>(ky) * stride;
    const int from_y = y * p.stride_y + ky - p.pad_y;
    if (from_y < 0 || from_y >= p.height) {
      std::fill_n(to, stride, 0u);
      continue;
    }
    const u32* from = tensor + static_cast<std::size_t>(n * p.height + from_y) * width;
    std::fill_n(to, pad, 0u);
    std::copy_n(from, width, to + pad);
    std::fill_n(to + pad + width, pad, 0u);
    for (std::size_t i = 0; i < width; ++i) any |= from[i];
  }
  return {rows.data(), stride, (any & 0x80808080u) != 0};
}

/// `kPixels` neighbouring outputs by kVectors * kLanes channels, from the first.
template <bool kSigned, int kPixels, int kVectors>
HWY_INLINE void tile(const convolve_params& p, const Window& window, int x, const u32* weights, const s32* channels,
                     int first, u8* out) {
  Sums sums[kPixels][kVectors];
  for (auto& pixel : sums) {
    for (Sums& sum : pixel) sum = zero_sums();
  }
  const std::size_t words = static_cast<std::size_t>(p.words);
  const std::size_t step = static_cast<std::size_t>(p.stride_x) * words;
  const std::size_t out_channels = static_cast<std::size_t>(p.out_words) * 4;
  const std::size_t group = static_cast<std::size_t>(first / 4 / p.group_out_words * p.group_words);
  const u32* weight = weights + first;
  for (int ky = 0; ky < p.kernel_height; ++ky) {
    const u32* row =
        window.rows + static_cast<std::size_t>(ky) * window.stride + static_cast<std::size_t>(x) * step + group;
    for (int kx = 0; kx < p.kernel_width; ++kx, row += words) {
      for (int word = 0; word < p.group_words; ++word, weight += out_channels) {
        Words w[kVectors];
        for (int v = 0; v < kVectors; ++v) w[v] = load_words(weight + v * kLanes);
        for (int pixel = 0; pixel < kPixels; ++pixel) {
          const Words a = same_word(row[static_cast<std::size_t>(pixel) * step + static_cast<std::size_t>(word)]);
          for (int v = 0; v < kVectors; ++v) sums[pixel][v] = add_products<kSigned>(sums[pixel][v], a, w[v]);
        }
      }
    }
  }
  for (int pixel = 0; pixel < kPixels; ++pixel) {
    u8* to = out + static_cast<std::size_t>(pixel) * out_channels;
    for (int v = 0; v < kVectors; ++v) requantise(sums[pixel][v], channels + v * kLanes * 2, p.shift, to + v * kLanes);
  }
}

template <bool kSigned, int kVectors>
void channel_block(const convolve_params& p, const Window& window, const u32* weights, const s32* channels, int first,
                   u8* out) {
  constexpr int kPixels = 6;
  const s32* block_channels = channels + first * 2;
  const int out_channels = p.out_words * 4;
  u8* to = out + first;
  int x = 0;
  for (; x + kPixels <= p.out_width; x += kPixels) {
    tile<kSigned, kPixels, kVectors>(p, window, x, weights, block_channels, first, to + x * out_channels);
  }
  for (; x + 3 <= p.out_width; x += 3) {
    tile<kSigned, 3, kVectors>(p, window, x, weights, block_channels, first, to + x * out_channels);
  }
  for (; x < p.out_width; ++x) {
    tile<kSigned, 1, kVectors>(p, window, x, weights, block_channels, first, to + x * out_channels);
  }
}

template <bool kSigned>
void output_row(const convolve_params& p, const Window& window, const u32* weights, const s32* channels, u8* out) {
  const int group_channels = p.group_out_words * 4;
  for (int group = 0; group < p.out_words * 4; group += group_channels) {
    int first = group;
    for (; first + 2 * kLanes <= group + group_channels; first += 2 * kLanes) {
      channel_block<kSigned, 2>(p, window, weights, channels, first, out);
    }
    for (; first + kLanes <= group + group_channels; first += kLanes) {
      channel_block<kSigned, 1>(p, window, weights, channels, first, out);
    }
  }
}

}  // namespace

void convolve(const convolve_params& p, const u32* tensor, const u32* weights, const s32* channels, u32* out_tensor,
              int first, int last) {
  Rows rows;
  for (int row = first; row < last; ++row) {
    const Window window = gather(p, tensor, row / p.out_height, row % p.out_height, rows);
    u8* out = reinterpret_cast<u8*>(out_tensor + static_cast<std::size_t>(row) *
                                                     static_cast<std::size_t>(p.out_width * p.out_words));
    window.has_negative ? output_row<true>(p, window, weights, channels, out)
                        : output_row<false>(p, window, weights, channels, out);
  }
}

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth::simd_backend {
BERTH_SIMD_DISPATCH(convolve,
                    (const convolve_params& p, const u32* tensor, const u32* weights, const s32* channels,
                     u32* out_tensor, int first, int last),
                    (p, tensor, weights, channels, out_tensor, first, last))
}  // namespace berth::simd_backend
#endif
