#include <algorithm>
#include <cstring>

#include "simd/simd_ops.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/max_pool.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

void max_pool(const max_pool_params& p, const u32* tensor, u32* out_tensor) {
  const hn::ScalableTag<signed char> d;
  const std::size_t lanes = hn::Lanes(d);
  const std::size_t channels = static_cast<std::size_t>(p.words) * 4;
  const std::size_t row_bytes = static_cast<std::size_t>(p.width) * channels;
  const std::size_t kernel = static_cast<std::size_t>(p.kernel_side);
  const signed char* in = reinterpret_cast<const signed char*>(tensor);
  signed char* out = reinterpret_cast<signed char*>(out_tensor);
  for (int row = 0; row < p.count * p.out_height; ++row) {
    const int from_y = row / p.out_height * p.height + row % p.out_height * p.stride;
    for (int x = 0; x < p.out_width; ++x, out += channels) {
      const signed char* from =
          in + static_cast<std::size_t>(from_y) * row_bytes + static_cast<std::size_t>(x * p.stride) * channels;
      std::size_t c = 0;
      for (; c + lanes <= channels; c += lanes) {
        auto greatest = hn::LoadU(d, from + c);
        for (std::size_t ky = 0; ky < kernel; ++ky) {
          for (std::size_t kx = 0; kx < kernel; ++kx) {
            greatest = hn::Max(greatest, hn::LoadU(d, from + ky * row_bytes + kx * channels + c));
          }
        }
        hn::StoreU(greatest, d, out + c);
      }
      for (; c < channels; ++c) {
        signed char greatest = from[c];
        for (std::size_t ky = 0; ky < kernel; ++ky) {
          for (std::size_t kx = 0; kx < kernel; ++kx) {
            greatest = std::max(greatest, from[ky * row_bytes + kx * channels + c]);
          }
        }
        out[c] = greatest;
      }
    }
  }
}

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth::simd_backend {
BERTH_SIMD_DISPATCH(max_pool, (const max_pool_params& p, const u32* tensor, u32* out_tensor), (p, tensor, out_tensor))
}  // namespace berth::simd_backend
#endif
