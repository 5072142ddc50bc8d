#include "reference/reference.hpp"
#include "reference/tensor.hpp"

namespace berth::reference {

// A convolution whose kernel is rows × columns at every grid position, one pixel apart; its sums with their biases
// requantised, or as they are where shift is negative.
void fully_connected(const fully_connected_params& p, const u32* tensor, const u32* weights, const s32* channels,
                     u32* out_tensor) {
  const int in_channels = p.words * 4;
  const auto sum_at = [&](int n, int y, int x, int channel) {
    std::int64_t sum = 0;
    for (int row = 0; row < p.rows; ++row) {
      for (int column = 0; column < p.columns; ++column) {
        for (int c = 0; c < in_channels; ++c) {
          sum += s8_at(tensor, element(n, y + row, x + column, c, p.height, p.width, in_channels)) *
                 s8_at(weights, element(channel, row, column, c, p.rows, p.columns, in_channels));
        }
      }
    }
    return sum;
  };
  for (int n = 0; n < p.count; ++n) {
    for (int y = 0; y < p.grid_height; ++y) {
      for (int x = 0; x < p.grid_width; ++x) {
        for (int channel = 0; channel < p.out_channels; ++channel) {
          const std::int64_t sum = sum_at(n, y, x, channel) + channels[channel * 2];
          const std::size_t to = element(n, y, x, channel, p.grid_height, p.grid_width, p.out_channels);
          if (p.shift < 0) {
            out_tensor[to] = static_cast<u32>(static_cast<s32>(sum));
          } else {
            set_s8(out_tensor, to, requantized(sum, channels[channel * 2 + 1], p.shift));
          }
        }
      }
    }
  }
}

}  // namespace berth::reference
