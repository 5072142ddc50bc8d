#include <algorithm>
#include <array>
#include <cstring>
#include <type_traits>

#include "simd/simd_ops.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/convolve.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

#include "simd/dot-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {
#include "simd/convolve_body.inl"
}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
#include "simd/dot_vnni.hpp"

#ifdef BERTH_SIMD_VNNI
HWY_PUSH_ATTRIBUTES(BERTH_SIMD_VNNI)
namespace berth::simd_backend::vnni {
#include "simd/convolve_body.inl"
}  // namespace berth::simd_backend::vnni
HWY_POP_ATTRIBUTES
#endif

namespace berth::simd_backend {
HWY_EXPORT(convolve);
#ifdef BERTH_SIMD_VNNI
HWY_EXPORT(has_avx512);
#endif
void convolve(const convolve_params& p, const u32* tensor, const u32* weights, const s32* channels, u32* out_tensor,
              int first, int last) {
#ifdef BERTH_SIMD_VNNI
  if (vnni::here() && HWY_DYNAMIC_DISPATCH(has_avx512)() && p.group_out_words * 4 % vnni::kLanes == 0) {
    vnni::convolve(p, tensor, weights, channels, out_tensor, first, last);
    return;
  }
#endif
  HWY_DYNAMIC_DISPATCH(convolve)(p, tensor, weights, channels, out_tensor, first, last);
}
}  // namespace berth::simd_backend
#endif
