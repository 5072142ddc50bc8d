#include <algorithm>
#include <cstdint>

#include "simd/simd_ops.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/local_response_norm.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

constexpr std::size_t kKnots = 104;

/// Knots of the table's first segment, every 32 up to 2048: as bytes, for look-ups within registers.
constexpr std::size_t kNear = 64;

using Squares = std::uint16_t;

struct Table {
  s32 value[kKnots];
  s32 rise[kKnots];  // to the next knot
  bool near_fits;    // every rise of the first segment fits a byte
  HWY_ALIGN u8 near_low[kNear];
  HWY_ALIGN u8 near_high[kNear];
  HWY_ALIGN u8 near_rise[kNear];
#if HWY_TARGET == HWY_AVX3
  bool rises_fit;                       // twice every rise fits 16 bits
  HWY_ALIGN Squares near_value[kNear];  // for look-ups in two registers
  HWY_ALIGN Squares far_value[kNear];   // from knot 64 on
  HWY_ALIGN std::int16_t near_rises[kNear];
  HWY_ALIGN std::int16_t far_rises[kNear];
#endif
};

void prepare(const s32* knots, Table& table) {
  table.near_fits = true;
  for (std::size_t i = 0; i < kKnots; ++i) {
    table.value[i] = knots[i];
    table.rise[i] = i + 1 < kKnots ? knots[i + 1] - knots[i] : 0;
    if (i >= kNear) continue;
    table.near_fits = table.near_fits && table.rise[i] >= -128 && table.rise[i] <= 127;
    table.near_low[i] = static_cast<u8>(knots[i] & 255);
    table.near_high[i] = static_cast<u8>(knots[i] >> 8);
    table.near_rise[i] = static_cast<u8>(table.rise[i] & 255);
  }
#if HWY_TARGET == HWY_AVX3
  table.rises_fit =
      std::all_of(table.rise, table.rise + kKnots - 1, [](s32 rise) { return rise > -16384 && rise < 16384; });
  for (std::size_t i = 0; i < kNear; ++i) {
    const std::size_t far = std::min(kNear + i, kKnots - 1);
    table.near_value[i] = static_cast<Squares>(table.value[i]);
    table.far_value[i] = static_cast<Squares>(table.value[far]);
    table.near_rises[i] = static_cast<std::int16_t>(2 * table.rise[i]);
    table.far_rises[i] = static_cast<std::int16_t>(2 * table.rise[far]);
  }
#endif
}

/// Outputs from activations and the sums of five half squares.
template <class D>
HWY_INLINE hn::Vec<D> responses(D d, const Table& table, hn::Vec<D> a, hn::Vec<D> sum) {
  const auto near = hn::Lt(sum, hn::Set(d, 2048));
  const auto knot = hn::IfThenElse(near, hn::ShiftRight<5>(sum), hn::Add(hn::ShiftRight<10>(sum), hn::Set(d, 62)));
  const auto part = hn::IfThenElse(near, hn::ShiftLeft<3>(hn::And(sum, hn::Set(d, 31))),
                                   hn::ShiftRight<2>(hn::And(sum, hn::Set(d, 1023))));
  const auto value = hn::GatherIndex(d, table.value, knot);
  const auto rise = hn::GatherIndex(d, table.rise, knot);
  const auto factor = hn::Add(value, hn::ShiftRight<8>(hn::Add(hn::Mul(rise, part), hn::Set(d, 128))));
  const auto scaled = hn::ShiftRight<14>(hn::Add(hn::Mul(a, factor), hn::Set(d, 8192)));
  return hn::Min(scaled, hn::Set(d, 127));
}

template <class D>
HWY_INLINE hn::Vec<D> sum_of_five(D d, const Squares* squares) {
  auto sum = hn::LoadU(d, squares);
  for (int k = 1; k < 5; ++k) sum = hn::Add(sum, hn::LoadU(d, squares + k));
  return sum;
}

/// The same for channels one register of s32 at a time, then one by one.
void responses_by_gathers(const Table& table, const signed char* in, int first, int last, const Squares* squares,
                          signed char* out) {
  const hn::ScalableTag<s32> d;
  const hn::Rebind<signed char, decltype(d)> bytes;
  const hn::Rebind<Squares, decltype(d)> halves;
  const int lanes = static_cast<int>(hn::Lanes(d));
  int c = first;
  for (; c + lanes <= last; c += lanes) {
    const auto a = hn::PromoteTo(d, hn::LoadU(bytes, in + c));
    const auto sum = hn::PromoteTo(d, sum_of_five(halves, squares + c));
    hn::StoreU(hn::DemoteTo(bytes, responses(d, table, a, sum)), bytes, out + c);
  }
  const hn::CappedTag<s32, 1> one;
  for (; c < last; ++c) {
    const s32 sum = squares[c] + squares[c + 1] + squares[c + 2] + squares[c + 3] + squares[c + 4];
    out[c] = static_cast<signed char>(hn::GetLane(responses(one, table, hn::Set(one, in[c]), hn::Set(one, sum))));
  }
}

#if HWY_TARGET != HWY_SCALAR
/// Bytes of a table of 64 by the low six bits of 16-bit lanes, in their low bytes; the high ones are anything.
template <class D>
HWY_INLINE hn::Vec<D> look_up(D d, const u8* table, hn::Vec<D> index) {
  const hn::Repartition<u8, D> bytes;
  const auto at = hn::BitCast(bytes, hn::And(index, hn::Set(d, 15)));
  const auto quarter = [&](int k) { return hn::TableLookupBytes(hn::LoadDup128(bytes, table + 16 * k), at); };
  const auto odd =
      hn::MaskFromVec(hn::BitCast(bytes, hn::Sub(hn::Zero(d), hn::And(hn::ShiftRight<4>(index), hn::Set(d, 1)))));
  const auto upper = hn::MaskFromVec(hn::BitCast(bytes, hn::Sub(hn::Zero(d), hn::ShiftRight<5>(index))));
  return hn::BitCast(d, hn::IfThenElse(upper, hn::IfThenElse(odd, quarter(3), quarter(2)),
                                       hn::IfThenElse(odd, quarter(1), quarter(0))));
}

/// Outputs where no activation is negative and every sum is below 2048.
template <class D>
HWY_INLINE hn::Vec<D> near_responses(D d, const Table& table, hn::Vec<D> a, hn::Vec<D> sum) {
  const hn::RebindToSigned<D> s;
  const auto knot = hn::ShiftRight<5>(sum);
  const auto value = hn::Or(hn::And(look_up(d, table.near_low, knot), hn::Set(d, 255)),
                            hn::ShiftLeft<8>(look_up(d, table.near_high, knot)));
  const auto rise = hn::ShiftRight<8>(hn::BitCast(s, hn::ShiftLeft<8>(look_up(d, table.near_rise, knot))));
  const auto part = hn::BitCast(s, hn::ShiftLeft<3>(hn::And(sum, hn::Set(d, 31))));
  const auto factor =
      hn::Add(value, hn::BitCast(d, hn::ShiftRight<8>(hn::Add(hn::Mul(rise, part), hn::Set(s, std::int16_t{128})))));
  // (a factor + 2^13) >> 14, from the product's halves.
  const auto low = hn::Mul(a, factor);
  const auto scaled = hn::Add(hn::Add(hn::ShiftLeft<2>(hn::MulHigh(a, factor)), hn::ShiftRight<14>(low)),
                              hn::And(hn::ShiftRight<13>(low), hn::Set(d, 1)));
  return hn::Min(scaled, hn::Set(d, 127));
}
#endif

#if HWY_TARGET == HWY_AVX3
/// Entries of a table of 64 by the low six bits of 16-bit lanes.
HWY_INLINE __m512i entries(const void* table, __m512i at) {
  const char* bytes = static_cast<const char*>(table);
  return _mm512_permutex2var_epi16(_mm512_load_si512(bytes), at, _mm512_load_si512(bytes + 64));
}

/// Outputs of 32 channels, where no activation is negative and the rises fit.
HWY_INLINE __m256i responses_in_registers(const Table& table, __m512i a, __m512i sum) {
  const auto all = [](int value) { return _mm512_set1_epi16(static_cast<short>(value)); };
  const __mmask32 far = _mm512_test_epi16_mask(sum, all(0xf800));
  const __m512i near_knot = _mm512_srli_epi16(sum, 5);
  const __m512i far_knot = _mm512_sub_epi16(_mm512_srli_epi16(sum, 10), all(2));
  const __m512i value =
      _mm512_mask_blend_epi16(far, entries(table.near_value, near_knot), entries(table.far_value, far_knot));
  const __m512i twice_rise =
      _mm512_mask_blend_epi16(far, entries(table.near_rises, near_knot), entries(table.far_rises, far_knot));
  const __m512i part = _mm512_mask_blend_epi16(far, _mm512_slli_epi16(_mm512_and_si512(sum, all(31)), 3),
                                               _mm512_srli_epi16(_mm512_and_si512(sum, all(1023)), 2));
  // (rise part + 128) >> 8: the product's high bits, and bit 7 of its low ones.
  const __m512i high = _mm512_mulhi_epi16(twice_rise, _mm512_slli_epi16(part, 7));
  const __m512i half = _mm512_and_si512(_mm512_srli_epi16(_mm512_mullo_epi16(twice_rise, part), 8), all(1));
  const __m512i factor = _mm512_add_epi16(value, _mm512_add_epi16(high, half));
  // (a factor + 2^13) >> 14 likewise.
  const __m512i low = _mm512_mullo_epi16(a, factor);
  const __m512i scaled = _mm512_add_epi16(
      _mm512_add_epi16(_mm512_slli_epi16(_mm512_mulhi_epu16(a, factor), 2), _mm512_srli_epi16(low, 14)),
      _mm512_and_si512(_mm512_srli_epi16(low, 13), all(1)));
  return _mm512_cvtepi16_epi8(_mm512_min_epu16(scaled, all(127)));
}
#endif

/// One pixel's channels, from their half squares between two zeros before and after.
void pixel_responses(const Table& table, const signed char* in, int channels, const Squares* squares,
                     signed char* out) {
  int c = 0;
#if HWY_TARGET == HWY_AVX3
  for (; table.rises_fit && c + 32 <= channels; c += 32) {
    const __m512i a = _mm512_cvtepi8_epi16(_mm256_loadu_si256(reinterpret_cast<const __m256i*>(in + c)));
    if (_mm512_movepi16_mask(a) != 0) {
      responses_by_gathers(table, in, c, c + 32, squares, out);
      continue;
    }
    const __m512i sum = sum_of_five(hn::ScalableTag<Squares>(), squares + c).raw;
    _mm256_storeu_si256(reinterpret_cast<__m256i*>(out + c), responses_in_registers(table, a, sum));
  }
#elif HWY_TARGET != HWY_SCALAR
  const hn::ScalableTag<Squares> d;
  const hn::RebindToSigned<decltype(d)> s;
  const hn::Rebind<signed char, decltype(d)> bytes;
  const int lanes = static_cast<int>(hn::Lanes(d));
  for (; table.near_fits && c + lanes <= channels; c += lanes) {
    const auto a = hn::BitCast(d, hn::PromoteTo(s, hn::LoadU(bytes, in + c)));
    const auto sum = sum_of_five(d, squares + c);
    if (hn::AllTrue(d, hn::Eq(hn::Or(hn::ShiftRight<11>(sum), hn::ShiftRight<15>(a)), hn::Zero(d)))) {
      hn::StoreU(hn::DemoteTo(bytes, hn::BitCast(s, near_responses(d, table, a, sum))), bytes, out + c);
    } else {
      responses_by_gathers(table, in, c, c + lanes, squares, out);
    }
  }
#endif
  if (c < channels) responses_by_gathers(table, in, c, channels, squares, out);
}

}  // namespace

void local_response_norm(const local_response_norm_params& p, const u32* tensor, const s32* table, u32* out_tensor,
                         int first, int last) {
  const int channels = p.words * 4;
  Table knots;
  prepare(table, knots);
  // Some pixels' squares are all written before the first is read again: what was just written in other pieces is slow
  // to read.
  const int each = channels + 4;
  Squares squares[2 * (kMaxResponseChannels + 4)] = {};
  const int most = 2 * (kMaxResponseChannels + 4) / each;
  for (int begin = first; begin < last; begin += most) {
    const int end = std::min(last, begin + most);
    const auto channels_of = [&](auto* words, int pixel) {
      return words + static_cast<std::size_t>(pixel) * static_cast<std::size_t>(p.words);
    };
    for (int pixel = begin; pixel < end; ++pixel) {
      const signed char* in = reinterpret_cast<const signed char*>(channels_of(tensor, pixel));
      Squares* to = squares + (pixel - begin) * each + 2;
      for (int c = 0; c < channels; ++c) to[c] = static_cast<Squares>(in[c] * in[c] >> 1);
    }
    for (int pixel = begin; pixel < end; ++pixel) {
      pixel_responses(knots, reinterpret_cast<const signed char*>(channels_of(tensor, pixel)), channels,
                      squares + (pixel - begin) * each, reinterpret_cast<signed char*>(channels_of(out_tensor, pixel)));
    }
  }
}

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth::simd_backend {
BERTH_SIMD_DISPATCH(local_response_norm,
                    (const local_response_norm_params& p, const u32* tensor, const s32* table, u32* out_tensor,
                     int first, int last),
                    (p, tensor, table, out_tensor, first, last))
}  // namespace berth::simd_backend
#endif
