#include <algorithm>

#include "simd/simd_ops.hpp"

namespace berth::simd_backend {
namespace {

constexpr int kLevels = 256;

/// The first level whose cumulative count exceeds count * permille / 1000; 255 when there is none.
u32 quantile(const u32* counts, u32 count, int permille) {
  u32 below = 0;
  for (u32 level = 0; level < kLevels; ++level) {
    below += counts[level];
    if (below * 1000 > count * static_cast<u32>(permille)) return level;
  }
  return 255;
}

}  // namespace

// kernels/normalize.inl without its groups; the sums of a histogram are for the compiler to do in vectors.
void normalize(const normalize_params& p, const u32* histograms, u32* levels) {
  u32 counts[3 * kLevels] = {};
  for (int group = 0; group < p.groups; ++group) {
    for (int bin = 0; bin < 3 * kLevels; ++bin) counts[bin] += histograms[group * 3 * kLevels + bin];
  }
  u32 count[3] = {};
  for (int kind = 0; kind < 3; ++kind) {
    for (int level = 0; level < kLevels; ++level) count[kind] += counts[kind * kLevels + level];
  }
  const u32 black = quantile(counts, count[0], p.black_permille);
  const u32 white = quantile(counts + kLevels, count[1], p.white_permille);
  const u32 noise = quantile(counts + 2 * kLevels, count[2], p.noise_permille);
  const u32 range = white > black ? white - black : 0;
  const u32 by_range = (range * static_cast<u32>(p.contrast_permille) + 500) / 1000;
  const u32 by_noise = (noise * static_cast<u32>(p.noise_gain_q4) + 8) / 16;
  levels[0] = black;
  levels[1] = white;
  levels[2] = noise;
  levels[3] = std::min(std::max(std::max(by_range, by_noise), static_cast<u32>(p.min_contrast)),
                       static_cast<u32>(p.max_contrast));
}

}  // namespace berth::simd_backend
