#include <cstring>

#include "simd/simd_ops.hpp"

namespace berth::simd_backend {

// No vector can count into bins; what helps is not paying for 128 items a group.
void tile_histogram(const tile_histogram_params& p, const u32* minima, const u32* maxima, u32* histograms) {
  std::memset(histograms, 0, static_cast<std::size_t>(p.groups) * 768 * sizeof(u32));
  int turn = 0;
  for (int word = 0; word < p.words; word += p.step, ++turn) {
    u32* counts = histograms + turn / kGroupSize % p.groups * 768;
    u32 low = minima[word];
    u32 high = maxima[word];
    for (int k = 0; k < 4; ++k, low >>= 8, high >>= 8) {
      const u32 darkest = low & 255u;
      const u32 lightest = high & 255u;
      ++counts[darkest];
      ++counts[256 + lightest];
      ++counts[512 + lightest - darkest];
    }
  }
}

}  // namespace berth::simd_backend
