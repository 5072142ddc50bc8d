#include <algorithm>
#include <array>

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

/// The table and what each knot is below the next.
struct Table {
  std::array<s32, kKnots> value;
  std::array<s32, kKnots> rise;
};

/// Outputs of the channels from `c`, eight at most, from their activations and the sums of five half squares.
template <class D>
HWY_INLINE hn::Vec<D> responses(D d, const Table& table, hn::Vec<D> a, hn::Vec<D> sum) {
  const auto near = hn::Lt(sum, hn::Set(d, 2048));
  const auto knot = hn::IfThenElse(near, hn::ShiftRight<5>(sum), hn::Add(hn::ShiftRight<10>(sum), hn::Set(d, 62)));
  const auto part = hn::IfThenElse(near, hn::ShiftLeft<3>(hn::And(sum, hn::Set(d, 31))),
                                   hn::ShiftRight<2>(hn::And(sum, hn::Set(d, 1023))));
  const auto value = hn::GatherIndex(d, table.value.data(), knot);
  const auto rise = hn::GatherIndex(d, table.rise.data(), knot);
  const auto factor = hn::Add(value, hn::ShiftRight<8>(hn::Add(hn::Mul(rise, part), hn::Set(d, 128))));
  const auto scaled = hn::ShiftRight<14>(hn::Add(hn::Mul(a, factor), hn::Set(d, 8192)));
  return hn::Min(scaled, hn::Set(d, 127));
}

/// One pixel's channels: `squares` is room for them and two zeros before and after.
void pixel_responses(const Table& table, const signed char* in, int channels, s32* squares, signed char* out) {
  const hn::ScalableTag<s32> d;
  const hn::Rebind<signed char, decltype(d)> bytes;
  const int lanes = static_cast<int>(hn::Lanes(d));
  for (int c = 0; c < channels; ++c) squares[c + 2] = in[c] * in[c] >> 1;
  int c = 0;
  for (; c + lanes <= channels; c += lanes) {
    const auto a = hn::PromoteTo(d, hn::LoadU(bytes, in + c));
    auto sum = hn::LoadU(d, squares + c);
    for (int k = 1; k < 5; ++k) sum = hn::Add(sum, hn::LoadU(d, squares + c + k));
    hn::StoreU(hn::DemoteTo(bytes, responses(d, table, a, sum)), bytes, out + c);
  }
  const hn::CappedTag<s32, 1> one;
  for (; c < channels; ++c) {
    const s32 sum = squares[c] + squares[c + 1] + squares[c + 2] + squares[c + 3] + squares[c + 4];
    out[c] = static_cast<signed char>(hn::GetLane(responses(one, table, hn::Set(one, in[c]), hn::Set(one, sum))));
  }
}

}  // namespace

void local_response_norm(const local_response_norm_params& p, const u32* tensor, const s32* table, u32* out_tensor,
                         int first, int last) {
  const int channels = p.words * 4;
  Table knots{};
  std::copy_n(table, kKnots, knots.value.begin());
  for (std::size_t i = 0; i + 1 < kKnots; ++i) knots.rise[i] = table[i + 1] - table[i];
  s32 squares[kMaxResponseChannels + 4] = {};
  std::fill_n(squares + channels + 2, 2, 0);
  for (int pixel = first; pixel < last; ++pixel) {
    const std::size_t at = static_cast<std::size_t>(pixel) * static_cast<std::size_t>(p.words);
    pixel_responses(knots, reinterpret_cast<const signed char*>(tensor + at), channels, squares,
                    reinterpret_cast<signed char*>(out_tensor + at));
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
