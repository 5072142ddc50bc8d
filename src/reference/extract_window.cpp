#include <algorithm>
#include <cstdint>

#include "reference/layout.hpp"
#include "reference/reference.hpp"

namespace berth::reference {
namespace {

/// Length of pixel `at` within [low, high), 1/256 px.
std::int64_t overlap(std::int64_t at, std::int64_t low, std::int64_t high) {
  return std::max<std::int64_t>(0, std::min(high, at * 256 + 256) - std::max(low, at * 256));
}

/// The pixel that a coordinate in 1/256 px lies in.
std::int64_t pixel_of(std::int64_t at) { return at >= 0 ? at / 256 : -((-at + 255) / 256); }

}  // namespace

// Each window pixel is the mean of step × step 1/256 px of the image, weighted by area, rounded half up. Pixels outside
// the image are the nearest ones inside.
void extract_window(const extract_window_params& p, const u32* pixels, const s32* windows, u32* out_pixels) {
  const auto mean = [&](std::int64_t left, std::int64_t top, std::int64_t step) {
    std::int64_t sum = step * step / 2;
    for (std::int64_t y = pixel_of(top); y * 256 < top + step; ++y) {
      for (std::int64_t x = pixel_of(left); x * 256 < left + step; ++x) {
        const int inside_x = static_cast<int>(std::clamp<std::int64_t>(x, 0, p.width - 1));
        const int inside_y = static_cast<int>(std::clamp<std::int64_t>(y, 0, p.height - 1));
        sum += overlap(x, left, left + step) * overlap(y, top, top + step) *
               byte_at(pixels, p.row_words * 4, inside_x, inside_y);
      }
    }
    return static_cast<u32>(sum / (step * step));
  };
  for (int window = 0; window < p.count; ++window) {
    const s32* at = windows + window * 4;
    const int step = std::clamp(at[2], 256, 2560);
    for (int j = 0; j < p.out_height; ++j) {
      for (int word = 0; word < p.out_words; ++word) {
        u32 packed = 0;
        for (int k = 0; k < 4; ++k) {
          packed |= mean(at[0] + (word * 4 + k) * step, at[1] + j * step, step) << (8 * k);
        }
        out_pixels[(window * p.out_height + j) * p.out_words + word] = packed;
      }
    }
  }
}

}  // namespace berth::reference
