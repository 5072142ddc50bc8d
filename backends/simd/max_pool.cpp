#include "simd/simd_ops.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/max_pool.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

namespace {

/// The greatest of a kernel's pixels for channels [first, …) by whole vectors; returns how far it got.
template <class D>
HWY_INLINE std::size_t greatest(D d, const signed char* from, std::size_t kernel, std::size_t row_bytes,
                                std::size_t channels, std::size_t first, signed char* out) {
  const std::size_t lanes = hn::Lanes(d);
  std::size_t c = first;
  for (; c + lanes <= channels; c += lanes) {
    auto most = hn::LoadU(d, from + c);
    for (std::size_t ky = 0; ky < kernel; ++ky) {
      for (std::size_t kx = 0; kx < kernel; ++kx) {
        most = hn::Max(most, hn::LoadU(d, from + ky * row_bytes + kx * channels + c));
      }
    }
    hn::StoreU(most, d, out + c);
  }
  return c;
}

}  // namespace

void max_pool(const max_pool_params& p, const u32* tensor, u32* out_tensor) {
  const hn::ScalableTag<signed char> widest;
  const hn::CappedTag<signed char, 32> half;  // layers of 32 channels are usual, and less than the widest vectors
  const hn::CappedTag<signed char, 4> word;
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
      std::size_t c = greatest(widest, from, kernel, row_bytes, channels, 0, out);
      c = greatest(half, from, kernel, row_bytes, channels, c, out);
      greatest(word, from, kernel, row_bytes, channels, c, out);
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
