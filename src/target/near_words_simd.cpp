// Code words near a given one, a vector of them at a time.
#include "target/near_words.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "target/near_words_simd.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace berth::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

u64 near_bits(const u64* words, std::size_t count, u64 seen, int distance) {
  const hn::CappedTag<u64, 8> lanes;
  const std::size_t step = hn::Lanes(lanes);
  const hn::RebindToSigned<decltype(lanes)> signed_lanes;
  const auto pattern = hn::Set(lanes, seen);
  const auto past = hn::Set(signed_lanes, distance + 1);
  u64 near = 0;
  std::size_t i = 0;
  for (; i + step <= count; i += step) {
    const auto bits = hn::PopulationCount(hn::Xor(hn::LoadU(lanes, words + i), pattern));
    u8 mask[8] = {};
    hn::StoreMaskBits(signed_lanes, hn::Lt(hn::BitCast(signed_lanes, bits), past), mask);
    near |= static_cast<u64>(mask[0]) << i;
  }
  for (; i < count; ++i) near |= static_cast<u64>(__builtin_popcountll(words[i] ^ seen) <= distance) << i;
  return near;
}

}  // namespace berth::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth {

HWY_EXPORT(near_bits);

u64 near_words(const u64* words, std::size_t count, u64 seen, int distance) {
  return HWY_DYNAMIC_DISPATCH(near_bits)(words, count, seen, distance);
}

}  // namespace berth
#endif
