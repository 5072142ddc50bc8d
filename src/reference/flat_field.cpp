#include <algorithm>

#include "reference/layout.hpp"
#include "reference/reference.hpp"

namespace berth::reference {

// pixel' = min(255, round_half_up(pixel * gain / 4096)).
void flat_field(const flat_field_params& p, const u32* pixels, const u32* gains, u32* flat) {
  for (int i = 0; i < p.words; ++i) {
    u32 word = 0;
    for (int k = 0; k < 4; ++k) {
      const u32 pixel = static_cast<u32>(byte_at(pixels, 0, i * 4 + k, 0));
      const u32 gain = (gains[i * 2 + k / 2] >> (16 * (k % 2))) & 0xffffu;
      word |= std::min(255u, (pixel * gain + 2048u) / 4096u) << (8 * k);
    }
    flat[i] = word;
  }
}

}  // namespace berth::reference
