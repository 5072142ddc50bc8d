#include <algorithm>

#include "reference/reference.hpp"
#include "reference/tensor.hpp"

namespace berth::reference {
namespace {

/// The table's straight line at S: knots every 32 below 2048, every 1024 from there on.
std::int64_t factor_at(const s32* table, int sum) {
  const int i = sum < 2048 ? sum / 32 : 62 + sum / 1024;
  const int f = sum < 2048 ? sum % 32 * 8 : sum % 1024 / 4;
  return table[i] + floor_shift(std::int64_t{table[i + 1] - table[i]} * f + 128, 8);
}

}  // namespace

// Each channel times the factor of its sum of halved squares over itself and two channels to either side.
void local_response_norm(const local_response_norm_params& p, const u32* tensor, const s32* table, u32* out_tensor) {
  const int channels = p.words * 4;
  for (int pixel = 0; pixel < p.pixels; ++pixel) {
    const std::size_t first = static_cast<std::size_t>(pixel) * static_cast<std::size_t>(channels);
    for (int c = 0; c < channels; ++c) {
      int sum = 0;
      for (int near = std::max(0, c - 2); near <= std::min(channels - 1, c + 2); ++near) {
        const int value = s8_at(tensor, first + static_cast<std::size_t>(near));
        sum += value * value / 2;
      }
      const std::size_t at = first + static_cast<std::size_t>(c);
      const std::int64_t scaled = floor_shift(s8_at(tensor, at) * factor_at(table, sum) + (1 << 13), 14);
      set_s8(out_tensor, at, static_cast<int>(std::min<std::int64_t>(127, scaled)));
    }
  }
}

}  // namespace berth::reference
