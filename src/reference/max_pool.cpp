#include <algorithm>

#include "reference/reference.hpp"
#include "reference/tensor.hpp"

namespace berth::reference {

// The greatest of kernel × kernel values, per channel.
void max_pool(const max_pool_params& p, const u32* tensor, u32* out_tensor) {
  const int channels = p.words * 4;
  for (int n = 0; n < p.count; ++n) {
    for (int y = 0; y < p.out_height; ++y) {
      for (int x = 0; x < p.out_width; ++x) {
        for (int c = 0; c < channels; ++c) {
          int greatest = -128;
          for (int i = 0; i < p.kernel_side * p.kernel_side; ++i) {
            const std::size_t from = element(n, y * p.stride + i / p.kernel_side, x * p.stride + i % p.kernel_side, c,
                                             p.height, p.width, channels);
            greatest = std::max(greatest, s8_at(tensor, from));
          }
          set_s8(out_tensor, element(n, y, x, c, p.out_height, p.out_width, channels), greatest);
        }
      }
    }
  }
}

}  // namespace berth::reference
