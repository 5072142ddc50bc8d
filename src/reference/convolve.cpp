#include "reference/reference.hpp"
#include "reference/tensor.hpp"

namespace berth::reference {

// Each output channel is the sum of weights times inputs over the kernel and the channels of its group; outside the
// tensor inputs are 0. Weights are [kernel_height, kernel_width, group_words, out_channels, 4 input channels].
void convolve(const convolve_params& p, const u32* tensor, const u32* weights, const s32* channels, u32* out_tensor) {
  const int out_channels = p.out_words * 4;
  const int group_channels = p.group_words * 4;
  const auto sum_at = [&](int n, int y, int x, int channel) {
    const int group = channel / (p.group_out_words * 4);
    std::int64_t sum = 0;
    for (int ky = 0; ky < p.kernel_height; ++ky) {
      for (int kx = 0; kx < p.kernel_width; ++kx) {
        const int from_y = y * p.stride_y + ky - p.pad_y;
        const int from_x = x * p.stride_x + kx - p.pad_x;
        if (from_y < 0 || from_y >= p.height || from_x < 0 || from_x >= p.width) continue;
        const std::size_t from = element(n, from_y, from_x, group * group_channels, p.height, p.width, p.words * 4);
        for (int c = 0; c < group_channels; ++c) {
          const std::size_t weight = element(ky, kx, c / 4, channel, p.kernel_width, p.group_words, out_channels);
          sum += s8_at(tensor, from + static_cast<std::size_t>(c)) *
                 s8_at(weights, weight * 4 + static_cast<std::size_t>(c % 4));
        }
      }
    }
    return sum;
  };
  for (int n = 0; n < p.count; ++n) {
    for (int y = 0; y < p.out_height; ++y) {
      for (int x = 0; x < p.out_width; ++x) {
        for (int channel = 0; channel < out_channels; ++channel) {
          const std::int64_t sum = sum_at(n, y, x, channel) + channels[channel * 2];
          set_s8(out_tensor, element(n, y, x, channel, p.out_height, p.out_width, out_channels),
                 requantized(sum, channels[channel * 2 + 1], p.shift));
        }
      }
    }
  }
}

}  // namespace berth::reference
