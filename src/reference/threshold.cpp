#include <algorithm>

#include "reference/layout.hpp"
#include "reference/reference.hpp"

namespace berth::reference {

// A pixel is black when the 3 × 3 tiles around its own (fewer at the border) differ by the contrast or more and it is
// not above darkest + floor((lightest - darkest) * cut / 256).
void threshold(const threshold_params& p, const u32* pixels, const u32* minima, const u32* maxima, const u32* levels,
               u32* bits) {
  const int columns = p.row_words * 8;  // of tiles
  for (int y = 0; y < p.height; ++y) {
    for (int word = 0; word < p.row_words; ++word) {
      u32 row = 0;
      for (int x = word * 32; x < std::min(word * 32 + 32, p.width); ++x) {
        int darkest = 255;
        int lightest = 0;
        for (int ty = std::max(y / 4 - 1, 0); ty <= std::min(y / 4 + 1, p.tile_rows - 1); ++ty) {
          for (int tx = std::max(x / 4 - 1, 0); tx <= std::min(x / 4 + 1, columns - 1); ++tx) {
            darkest = std::min(darkest, byte_at(minima, columns, tx, ty));
            lightest = std::max(lightest, byte_at(maxima, columns, tx, ty));
          }
        }
        const bool judged = lightest - darkest >= static_cast<int>(levels[3]);
        const int limit = darkest + (lightest - darkest) * p.cut / 256;
        if (judged && byte_at(pixels, columns * 4, x, y) <= limit) row |= 1u << (x % 32);
      }
      bits[y * p.row_words + word] = row;
    }
  }
}

}  // namespace berth::reference
