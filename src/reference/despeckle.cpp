#include "reference/layout.hpp"
#include "reference/reference.hpp"

namespace berth::reference {

// Black pixels without a black neighbour left, right, above or below become white.
void despeckle(const despeckle_params& p, const u32* bits, u32* clean) {
  const int width = p.row_words * 32;
  const auto black = [&](int x, int y) {
    return x >= 0 && x < width && y >= 0 && y < p.height && bit_at(bits, p.row_words, x, y);
  };
  for (int y = 0; y < p.height; ++y) {
    for (int word = 0; word < p.row_words; ++word) {
      u32 row = 0;
      for (int x = word * 32; x < word * 32 + 32; ++x) {
        if (black(x, y) && (black(x - 1, y) || black(x + 1, y) || black(x, y - 1) || black(x, y + 1))) {
          row |= 1u << (x % 32);
        }
      }
      clean[y * p.row_words + word] = row;
    }
  }
}

}  // namespace berth::reference
