#include <algorithm>

#include "reference/layout.hpp"
#include "reference/reference.hpp"
#include "reference/tensor.hpp"

namespace berth::reference {

// Pixels about their window's mean, times its gain in q8, rounded half up, as s8.
void normalize_window(const normalize_window_params& p, const u32* pixels, const s32* statistics, u32* tensor) {
  for (int window = 0; window < p.count; ++window) {
    for (int i = 0; i < p.words * 4; ++i) {
      const int pixel = byte_at(pixels + window * p.words, 0, i, 0);
      const std::int64_t scaled = std::int64_t{pixel - statistics[window * 2]} * statistics[window * 2 + 1];
      set_s8(tensor + window * p.words, static_cast<std::size_t>(i),
             static_cast<int>(std::clamp<std::int64_t>(floor_shift(scaled + 128, 8), -128, 127)));
    }
  }
}

}  // namespace berth::reference
