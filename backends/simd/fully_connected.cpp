#include <algorithm>

#include "simd/simd_ops.hpp"

// Vectors are members of structures here, which those of run-time size cannot be.
#define HWY_DISABLED_TARGETS (HWY_SVE | HWY_SVE2 | HWY_SVE_256 | HWY_SVE2_128)
#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/fully_connected.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

#include "simd/dot-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

/// Channels whose weights are read side by side, and positions that share them.
constexpr int kChannels = 4;
constexpr int kPositions = 2;

s32 dot_words(const u32* a, const u32* w, int words) {
  s32 sum = 0;
  for (int i = 0; i < words; ++i) {
    for (int shift = 0; shift < 32; shift += 8) {
      sum += static_cast<signed char>(a[i] >> shift & 255u) * static_cast<signed char>(w[i] >> shift & 255u);
    }
  }
  return sum;
}

/// Sums of `channels` rows of weights at `count` positions.
void products(const fully_connected_params& p, const u32* const* positions, int count, const u32* weights,
              s32 (*sums)[kChannels]) {
  const int row_words = p.columns * p.words;
  const std::size_t each = static_cast<std::size_t>(p.rows * row_words);
  Sums acc[kPositions][kChannels];
  for (auto& position : acc) {
    for (Sums& sum : position) sum = zero_sums();
  }
  for (int k = 0; k < count; ++k) std::fill_n(sums[k], kChannels, 0);
  for (int y = 0; y < p.rows; ++y) {
    const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(p.width * p.words);
    const u32* w = weights + static_cast<std::size_t>(y) * static_cast<std::size_t>(row_words);
    int i = 0;
    for (; i + kLanes <= row_words; i += kLanes) {
      Words ws[kChannels];
      for (std::size_t c = 0; c < kChannels; ++c) ws[c] = load_words(w + c * each + i);
      for (int k = 0; k < count; ++k) {
        const Words a = load_words(positions[k] + row + i);
        for (std::size_t c = 0; c < kChannels; ++c) acc[k][c] = add_products<true>(acc[k][c], a, ws[c]);
      }
    }
    for (int k = 0; k < count; ++k) {
      for (std::size_t c = 0; c < kChannels; ++c) {
        sums[k][c] += dot_words(positions[k] + row + i, w + c * each + i, row_words - i);
      }
    }
  }
  const SumsTag d;
  for (int k = 0; k < count; ++k) {
    for (std::size_t c = 0; c < kChannels; ++c) sums[k][c] += hn::GetLane(hn::SumOfLanes(d, acc[k][c]));
  }
}

void store(const fully_connected_params& p, int channel, int position, const s32* channels, const s32* sums,
           u32* out_tensor) {
  u32 word = 0;
  const std::size_t to =
      static_cast<std::size_t>(position) * static_cast<std::size_t>(p.out_channels) + static_cast<std::size_t>(channel);
  for (int c = 0; c < kChannels; ++c) {
    const s32 sum = sums[c] + channels[(channel + c) * 2];
    if (p.shift < 0) {
      out_tensor[to + static_cast<std::size_t>(c)] = static_cast<u32>(sum);
    } else {
      const s32 a = std::clamp((sum + (p.shift > 0 ? 1 << (p.shift - 1) : 0)) >> p.shift, -32768, 32767);
      word |= static_cast<u32>(std::clamp((a * channels[(channel + c) * 2 + 1] + (1 << 21)) >> 22, 0, 127)) << (8 * c);
    }
  }
  if (p.shift >= 0) out_tensor[to / 4] = word;
}

}  // namespace

void fully_connected(const fully_connected_params& p, const u32* tensor, const u32* weights, const s32* channels,
                     u32* out_tensor, int first, int last) {
  const std::size_t each = static_cast<std::size_t>(p.rows * p.columns * p.words);
  const int all = p.count * p.grid_height * p.grid_width;
  for (int channel = first * kChannels; channel < last * kChannels; channel += kChannels) {
    for (int position = 0; position < all; position += kPositions) {
      const int count = std::min(kPositions, all - position);
      const u32* from[kPositions];
      for (int k = 0; k < count; ++k) {
        const int row = (position + k) / p.grid_width;
        const int y = row / p.grid_height * p.height + row % p.grid_height;
        from[k] = tensor + static_cast<std::size_t>(y * p.width + (position + k) % p.grid_width) *
                               static_cast<std::size_t>(p.words);
      }
      s32 sums[kPositions][kChannels];
      products(p, from, count, weights + static_cast<std::size_t>(channel) * each, sums);
      for (int k = 0; k < count; ++k) store(p, channel, position + k, channels, sums[k], out_tensor);
    }
  }
}

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth::simd_backend {
BERTH_SIMD_DISPATCH(fully_connected,
                    (const fully_connected_params& p, const u32* tensor, const u32* weights, const s32* channels,
                     u32* out_tensor, int first, int last),
                    (p, tensor, weights, channels, out_tensor, first, last))
}  // namespace berth::simd_backend
#endif
