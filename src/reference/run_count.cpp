#include "reference/layout.hpp"
#include "reference/reference.hpp"

namespace berth::reference {

// Run ends before each word of bits within its group of 128 words, and in each group. Words past the last have none;
// there is at least one of them, so that the run ends before the end of the image can be asked for too.
void run_count(const run_count_params& p, const u32* bits, u32* offsets) {
  const int words = p.height * p.row_words;
  const int groups = words / 128 + 1;
  for (int group = 0; group < groups; ++group) {
    u32 before = 0;
    for (int word = group * 128; word < group * 128 + 128; ++word) {
      offsets[word] = before;
      if (word >= words) continue;
      const int y = word / p.row_words;
      const int x0 = word % p.row_words * 32;
      for (int x = x0; x < x0 + 32; ++x) {
        const bool last = x > 0 && bit_at(bits, p.row_words, x - 1, y);
        if (bit_at(bits, p.row_words, x, y) != last) ++before;
      }
      if (x0 + 32 == p.row_words * 32 && bit_at(bits, p.row_words, x0 + 31, y)) ++before;
    }
    offsets[p.base_at + group] = before;
  }
}

}  // namespace berth::reference
