#include <algorithm>
#include <cstdint>

#include "reference/arithmetic.hpp"
#include "reference/layout.hpp"
#include "reference/reference.hpp"

namespace berth::reference {

// The rounded mean of every stride-th word's pixels, and the gain, q8, that makes their standard deviation 48.
void window_statistics(const window_statistics_params& p, const u32* pixels, s32* statistics) {
  for (int window = 0; window < p.count; ++window) {
    std::int64_t n = 0;
    std::int64_t sum = 0;
    std::int64_t squares = 0;
    for (int word = 0; word < p.words; word += p.stride) {
      for (int k = 0; k < 4; ++k) {
        const int pixel = byte_at(pixels + window * p.words, 0, word * 4 + k, 0);
        n += 1;
        sum += pixel;
        squares += pixel * pixel;
      }
    }
    const std::int64_t mean = (sum + n / 2) / n;
    const std::int64_t variance = std::max<std::int64_t>(0, squares / n - mean * mean);
    const int deviation = std::max(1, square_root(variance));
    statistics[window * 2] = static_cast<s32>(mean);
    statistics[window * 2 + 1] = std::clamp((256 * 48 + deviation / 2) / deviation, 128, 2048);
  }
}

}  // namespace berth::reference
