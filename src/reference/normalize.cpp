#include <algorithm>

#include "reference/reference.hpp"

namespace berth::reference {
namespace {

// The first level whose cumulative share exceeds permille / 1000; 255 when there is none.
u32 quantile(const normalize_params& p, const u32* histograms, int kind, int permille) {
  u64 count = 0;
  for (int i = 0; i < p.groups * 256; ++i) count += histograms[i / 256 * 768 + kind * 256 + i % 256];
  u64 below = 0;
  for (u32 level = 0; level < 256; ++level) {
    for (int group = 0; group < p.groups; ++group)
      below += histograms[group * 768 + kind * 256 + static_cast<int>(level)];
    if (below * 1000 > count * static_cast<u64>(permille)) return level;
  }
  return 255;
}

}  // namespace

// Black, white and noise are quantiles of the tiles' minima, maxima and ranges. The contrast asked of a tile is the
// greater of a share of the frame's range and a multiple of its noise, within bounds.
void normalize(const normalize_params& p, const u32* histograms, u32* levels) {
  const u32 black = quantile(p, histograms, 0, p.black_permille);
  const u32 white = quantile(p, histograms, 1, p.white_permille);
  const u32 noise = quantile(p, histograms, 2, p.noise_permille);
  const u32 range = white > black ? white - black : 0;
  const u32 by_range = (range * static_cast<u32>(p.contrast_permille) + 500) / 1000;
  const u32 by_noise = (noise * static_cast<u32>(p.noise_gain_q4) + 8) / 16;
  levels[0] = black;
  levels[1] = white;
  levels[2] = noise;
  levels[3] = std::min(std::max(std::max(by_range, by_noise), static_cast<u32>(p.min_contrast)),
                       static_cast<u32>(p.max_contrast));
}

}  // namespace berth::reference
