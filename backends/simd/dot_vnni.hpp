#pragma once

// dot-inl.hpp's words by AVX-512's dot products of bytes: 64 products an instruction. Highway 1.0.3 has no target with
// avx512vnni alone (its AVX3_DL lets the compiler use instructions of AVX-VNNI, which some such processors lack), so
// this is a target of our own. It stands for Highway's AVX3 where it can, so it is not used where a lesser target is
// asked for, as tests do of each in turn; of AVX3's own dot products those tests then see only what it cannot do
// (convolutions whose channels are no multiple of kLanes): all of them run on processors with AVX-512 but without VNNI.
#include <hwy/highway.h>

#include "berth/types.hpp"

#if HWY_ARCH_X86_64 && (HWY_COMPILER_GCC_ACTUAL || HWY_COMPILER_CLANG)
#include <immintrin.h>
#define BERTH_SIMD_VNNI "avx512f,avx512vl,avx512dq,avx512bw,avx512vnni"

HWY_PUSH_ATTRIBUTES(BERTH_SIMD_VNNI)
namespace berth::simd_backend::vnni {

using Sums = __m512i;
using Words = __m512i;
constexpr int kLanes = 16;
/// Of 32 registers: 16 to 20 sums, weights and inputs beside them. Four vectors of channels wide, a tile loads less for
/// each of its products.
constexpr int kMostVectors = 4;
constexpr int tile_pixels(int vectors) { return vectors == 4 ? 5 : 8; }
constexpr int kTilePositions = 4;
/// One factor is taken without its sign: where inputs have one, 128 is added to each byte.
constexpr u32 kOffset = 0x80808080u;

HWY_INLINE Sums zero_sums() { return _mm512_setzero_si512(); }
HWY_INLINE Sums negative(Sums sums) { return _mm512_sub_epi32(_mm512_setzero_si512(), sums); }
HWY_INLINE Words load_words(const u32* from) { return _mm512_loadu_si512(from); }
HWY_INLINE Words same_word(u32 word) { return _mm512_set1_epi32(static_cast<int>(word)); }
HWY_INLINE s32 sum_of(Sums sums) { return _mm512_reduce_add_epi32(sums); }

template <bool kSigned>
HWY_INLINE Sums add_products(Sums sums, Words a, Words w) {
  if (!kSigned) return _mm512_dpbusd_epi32(sums, a, w);
  const Words offset = same_word(kOffset);
  return _mm512_sub_epi32(_mm512_dpbusd_epi32(sums, _mm512_xor_si512(a, offset), w),
                          _mm512_dpbusd_epi32(_mm512_setzero_si512(), offset, w));
}

HWY_INLINE void requantise(Sums sums, const s32* channels, int shift, u8* output) {
  const Words even = _mm512_setr_epi32(0, 2, 4, 6, 8, 10, 12, 14, 16, 18, 20, 22, 24, 26, 28, 30);
  const Words low = _mm512_loadu_si512(channels);
  const Words high = _mm512_loadu_si512(channels + kLanes);
  const Words bias = _mm512_permutex2var_epi32(low, even, high);
  const Words multiplier = _mm512_permutex2var_epi32(low, _mm512_add_epi32(even, _mm512_set1_epi32(1)), high);
  const Words rounding = _mm512_set1_epi32(shift > 0 ? 1 << (shift - 1) : 0);
  const Words shifted =
      _mm512_sra_epi32(_mm512_add_epi32(_mm512_add_epi32(sums, bias), rounding), _mm_cvtsi32_si128(shift));
  const Words a = _mm512_min_epi32(_mm512_max_epi32(shifted, _mm512_set1_epi32(-32768)), _mm512_set1_epi32(32767));
  const Words scaled =
      _mm512_srai_epi32(_mm512_add_epi32(_mm512_mullo_epi32(a, multiplier), _mm512_set1_epi32(1 << 21)), 22);
  const Words held = _mm512_min_epi32(_mm512_max_epi32(scaled, _mm512_setzero_si512()), _mm512_set1_epi32(127));
  _mm_storeu_si128(reinterpret_cast<__m128i*>(output), _mm512_cvtepi32_epi8(held));
}

}  // namespace berth::simd_backend::vnni
HWY_POP_ATTRIBUTES

namespace berth::simd_backend::vnni {
/// Whether this processor has these instructions, and the system keeps their registers. Used with has_avx512 of the
/// target that Highway chose.
inline bool here() {
  static const bool found = __builtin_cpu_supports("avx512f") != 0 && __builtin_cpu_supports("avx512vl") != 0 &&
                            __builtin_cpu_supports("avx512dq") != 0 && __builtin_cpu_supports("avx512bw") != 0 &&
                            __builtin_cpu_supports("avx512vnni") != 0;
  return found;
}
}  // namespace berth::simd_backend::vnni
#endif
