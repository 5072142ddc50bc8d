// Sums of products of s8, four a word, kLanes sums at a time: for each instruction set, so without an include guard of
// the usual kind.
#if defined(BERTH_SIMD_DOT_INL) == defined(HWY_TARGET_TOGGLE)
#ifdef BERTH_SIMD_DOT_INL
#undef BERTH_SIMD_DOT_INL
#else
#define BERTH_SIMD_DOT_INL
#endif

#include <hwy/highway.h>

#include "berth/types.hpp"

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

using SumsTag = hn::CappedTag<s32, 8>;
using WordsTag = hn::CappedTag<u32, 8>;
using Sums = hn::Vec<SumsTag>;
using Words = hn::Vec<WordsTag>;
constexpr int kLanes = static_cast<int>(hn::MaxLanes(SumsTag()));
/// Of 16 registers: twelve sums of a convolution, eight of a fully connected layer, weights and inputs beside them.
constexpr int kMostVectors = 2;
constexpr int tile_pixels(int) { return 6; }
constexpr int kTilePositions = 2;
/// What inputs with a sign are moved by before they are multiplied: nothing (dot_vnni.hpp).
constexpr u32 kOffset = 0;

/// Whether instructions of AVX-512 may be used beside this target's (dot_vnni.hpp). Better targets have lower numbers.
HWY_INLINE bool has_avx512() { return HWY_ARCH_X86_64 && HWY_TARGET <= HWY_AVX3; }

HWY_INLINE Sums zero_sums() { return hn::Zero(SumsTag()); }
HWY_INLINE Sums negative(Sums sums) { return hn::Neg(sums); }
HWY_INLINE s32 sum_of(Sums sums) { return hn::GetLane(hn::SumOfLanes(SumsTag(), sums)); }
HWY_INLINE Words load_words(const u32* from) { return hn::LoadU(WordsTag(), from); }
HWY_INLINE Words same_word(u32 word) { return hn::Set(WordsTag(), word); }

/// Adds to each sum the products of a's and w's four bytes. Bounds: w >= -127; a >= 0 unless kSigned.
template <bool kSigned>
HWY_INLINE Sums add_products(Sums sums, Words a, Words w) {
#if HWY_TARGET == HWY_AVX2 || HWY_TARGET == HWY_AVX3 || HWY_TARGET == HWY_AVX3_DL
  // Pairs of products fit 16 bits: 2 * 128 * 127 < 2^15.
  const __m256i size = kSigned ? _mm256_abs_epi8(a.raw) : a.raw;
  const __m256i other = kSigned ? _mm256_sign_epi8(w.raw, a.raw) : w.raw;
  const __m256i pairs = _mm256_maddubs_epi16(size, other);
  return Sums{_mm256_add_epi32(sums.raw, _mm256_madd_epi16(pairs, _mm256_set1_epi16(1)))};
#else
  const SumsTag d;
  const auto as = hn::BitCast(d, a);
  const auto ws = hn::BitCast(d, w);
  const auto product = [](Sums x, Sums y) { return hn::Mul(hn::ShiftRight<24>(x), hn::ShiftRight<24>(y)); };
  return hn::Add(sums, hn::Add(hn::Add(product(hn::ShiftLeft<24>(as), hn::ShiftLeft<24>(ws)),
                                       product(hn::ShiftLeft<16>(as), hn::ShiftLeft<16>(ws))),
                               hn::Add(product(hn::ShiftLeft<8>(as), hn::ShiftLeft<8>(ws)), product(as, ws))));
#endif
}

/// kLanes sums to activations, by their channels' {bias, multiplier} pairs; docs/network-arithmetic.md.
HWY_INLINE void requantise(Sums sums, const s32* channels, int shift, u8* output) {
  const SumsTag d;
  Sums bias;
  Sums multiplier;
  hn::LoadInterleaved2(d, channels, bias, multiplier);
  const Sums rounding = hn::Set(d, shift > 0 ? 1 << (shift - 1) : 0);
  const Sums shifted = hn::ShiftRightSame(hn::Add(hn::Add(sums, bias), rounding), shift);
  const Sums a = hn::Min(hn::Max(shifted, hn::Set(d, -32768)), hn::Set(d, 32767));
  const Sums scaled = hn::ShiftRight<22>(hn::Add(hn::Mul(a, multiplier), hn::Set(d, 1 << 21)));
  const Sums held = hn::Min(hn::Max(scaled, hn::Zero(d)), hn::Set(d, 127));
#if HWY_TARGET == HWY_SCALAR
  *output = static_cast<u8>(hn::GetLane(held));
#else
  const hn::Rebind<u8, SumsTag> bytes;
  hn::StoreU(hn::DemoteTo(bytes, held), bytes, output);
#endif
}

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#endif
