#include <algorithm>

#include "reference/layout.hpp"
#include "reference/reference.hpp"

namespace berth::reference {

// Histograms of the tiles' minima, maxima and ranges, over every step-th tile word. The words are dealt to the partial
// histograms in turns of 128.
void tile_histogram(const tile_histogram_params& p, const u32* minima, const u32* maxima, u32* histograms) {
  std::fill(histograms, histograms + p.groups * 768, 0u);
  for (int turn = 0; turn * p.step < p.words; ++turn) {
    u32* counts = histograms + turn / 128 % p.groups * 768;
    for (int k = 0; k < 4; ++k) {
      const int darkest = byte_at(minima, 0, turn * p.step * 4 + k, 0);
      const int lightest = byte_at(maxima, 0, turn * p.step * 4 + k, 0);
      ++counts[darkest];
      ++counts[256 + lightest];
      ++counts[512 + lightest - darkest];
    }
  }
}

}  // namespace berth::reference
