#include <algorithm>

#include "reference/layout.hpp"
#include "reference/reference.hpp"

namespace berth::reference {

// Each pixel the mean of a 2 × 2 block, rounded half up; blocks past the source's end are its last ones.
void halve(const halve_params& p, const u32* pixels, u32* half_pixels) {
  const int width = p.row_words * 4;
  for (int y = 0; y < p.half_rows; ++y) {
    for (int word = 0; word < p.half_row_words; ++word) {
      u32 packed = 0;
      for (int k = 0; k < 4; ++k) {
        const int from_x = std::min((word * 4 + k) * 2, width - 2);
        const int from_y = std::min(y * 2, p.rows - 2);
        int sum = 2;
        for (int i = 0; i < 4; ++i) sum += byte_at(pixels, width, from_x + i % 2, from_y + i / 2);
        packed |= static_cast<u32>(sum / 4) << (8 * k);
      }
      half_pixels[y * p.half_row_words + word] = packed;
    }
  }
}

}  // namespace berth::reference
