#include <algorithm>

#include "reference/layout.hpp"
#include "reference/reference.hpp"

namespace berth::reference {

// The darkest and the lightest pixel of every 4 × 4 tile.
void tile_extrema(const tile_extrema_params& p, const u32* pixels, u32* minima, u32* maxima) {
  const int columns = p.row_words * 4;
  for (int ty = 0; ty < p.tile_rows; ++ty) {
    for (int word = 0; word < p.row_words; ++word) {
      u32 low = 0;
      u32 high = 0;
      for (int k = 0; k < 4; ++k) {
        int darkest = 255;
        int lightest = 0;
        for (int i = 0; i < 16; ++i) {
          const int pixel = byte_at(pixels, columns * 4, (word * 4 + k) * 4 + i % 4, ty * 4 + i / 4);
          darkest = std::min(darkest, pixel);
          lightest = std::max(lightest, pixel);
        }
        low |= static_cast<u32>(darkest) << (8 * k);
        high |= static_cast<u32>(lightest) << (8 * k);
      }
      minima[ty * p.row_words + word] = low;
      maxima[ty * p.row_words + word] = high;
    }
  }
}

}  // namespace berth::reference
