// Run ends: counted and written.
#define HWY_WANT_AVX3_DL  // counts bits and compresses lanes of 16
#include <algorithm>

#include "reference/layout.hpp"
#include "simd/simd_ops.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/runs.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

#include "simd/bit_rows-inl.hpp"
#include "simd/choose-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {

/// The words' counts in values[0, count) become their exclusive prefix sums; returns the total. May touch three words
/// behind them.
HWY_INLINE u32 sum_up(u32* values, int count) {
#if HWY_TARGET == HWY_SCALAR
  u32 before = 0;
  for (int i = 0; i < count; ++i) {
    const u32 value = values[i];
    values[i] = before;
    before += value;
  }
  return before;
#else
  // In fours: two steps within a block, and what came before from its last lane.
  const hn::CappedTag<u32, 4> words;
  auto before = hn::Zero(words);
  for (int i = 0; i < count; i += 4) {
    const auto value = hn::LoadU(words, values + i);
    auto sum = hn::Add(value, hn::ShiftLeftLanes<1>(words, value));
    sum = hn::Add(hn::Add(sum, hn::ShiftLeftLanes<2>(words, sum)), before);
    hn::StoreU(hn::Sub(sum, value), words, values + i);
    before = hn::Broadcast<3>(sum);
  }
  return hn::GetLane(before);
#endif
}

// Each word's run ends first, then their sums in every group.
void run_count(const run_count_params& p, const u32* bits, u32* offsets) {
  const RowTag words;
  const int lanes = row_lanes();
  const int row_words = p.row_words;  // p could be what is written to, for all the compiler knows
  const int total = p.height * row_words;
  const int groups = total / kGroupSize + 1;
  const u32* const bits_end = bits + total;
  // The last vector of a row reaches past it, where later rows will be written; of the last rows it must not.
  u32* counts = offsets;
  for (; bits_end - bits >= row_words + lanes; bits += row_words, counts += row_words) {
    RightMover right;
    for (int x = 0; x < row_words; x += lanes) {
      const auto here = hn::LoadU(words, bits + x);
      hn::StoreU(hn::PopulationCount(hn::Xor(here, right.moved(here))), words, counts + x);
    }
    if (bits[row_words - 1] >> 31 != 0) ++counts[row_words - 1];  // a row that ends black has a last crack
  }
  for (; bits != bits_end; bits += row_words, counts += row_words) {
    u32 before = 0;
    for (int x = 0; x < row_words; before = bits[x] >> 31, ++x) {
      counts[x] = popcount(bits[x] ^ ((bits[x] << 1) | before));
    }
    counts[row_words - 1] += before;
  }
  std::fill(counts, offsets + groups * kGroupSize, 0u);
  for (int group = 0; group < groups; ++group) {
    offsets[p.base_at + group] = sum_up(offsets + group * kGroupSize, kGroupSize);
  }
}

/// Where the set bits of a word are, added to `first`. Returns the end of what was written; something may lie behind
/// it, never at or past `limit`.
HWY_INLINE u32* emit_word(u32 edges, u32 first, u32* out, const u32* limit) {
#if HWY_TARGET == HWY_AVX3_DL
  // All 32 places are compressed at once; seldom are there more than sixteen of them.
  const hn::FixedTag<std::uint16_t, 32> places;
  const hn::FixedTag<u32, 16> words;
  if (limit - out >= 32) {
    const auto found = hn::Compress(hn::Iota(places, 0), hn::LoadMaskBits(places, reinterpret_cast<const u8*>(&edges)));
    const auto base = hn::Set(words, first);
    hn::StoreU(hn::Add(hn::PromoteTo(words, hn::LowerHalf(found)), base), words, out);
    const u32 count = popcount(edges);
    if (count > 16) {
      hn::StoreU(hn::Add(hn::PromoteTo(words, hn::UpperHalf(hn::Half<decltype(places)>(), found)), base), words,
                 out + 16);
    }
    return out + count;
  }
#elif HWY_TARGET != HWY_SCALAR
  // A byte at a time from a table: more instructions than bit by bit where edges are few, but nothing to foresee.
  const hn::CappedTag<u32, 8> words;
  const hn::Rebind<u8, decltype(words)> places;
  constexpr int kLanes = static_cast<int>(hn::MaxLanes(words));
  if (limit - out >= 32) {
    auto base = hn::Set(words, first);
    const auto next = hn::Set(words, 8);
    for (int byte = 0; byte < 4; ++byte, edges >>= 8, base = hn::Add(base, next)) {
      const u8* const found = kBitPlaces.of[edges & 255u];
      for (int i = 0; i < 8; i += kLanes) {
        hn::StoreU(hn::Add(hn::PromoteTo(words, hn::LoadU(places, found + i)), base), words, out + i);
      }
      out += popcount(edges & 255u);
    }
    return out;
  }
#endif
  (void)limit;
  for (; edges != 0; edges &= edges - 1) *out++ = first + static_cast<u32>(__builtin_ctz(edges));
  return out;
}

/// Words in which bits change, and the first pixel of each.
struct EdgeWords {
  static constexpr int kRoom = 1024;
  int count = 0;
  u32 edges[kRoom + kMaxRowWords + kRowSlack];
  u32 first[kRoom + kMaxRowWords + kRowSlack];

  /// With a word more than the row has: one that ends black ends with the last crack of its padded width.
  HWY_INLINE void add_row(const u32* row, int row_words) {
    const RowTag words;
    RightMover right;
    for (int x = 0; x <= row_words; x += row_lanes()) {
      const auto here = row_words_at(row, x, row_words);
      const auto changes = hn::Xor(here, right.moved(here));
      const Choice<RowTag> some(hn::Ne(changes, hn::Zero(words)));
      some.store(changes, edges + count);
      const auto pixels = hn::Add(hn::ShiftLeft<5>(hn::Iota(words, 0)), hn::Set(words, static_cast<u32>(x * 32)));
      some.store(pixels, first + count);
      count += some.count();
    }
  }
};

// Rows are looked through for the words that matter, and these written in one go: no loop's end to foresee in each row.
void run_emit(const run_emit_params& p, const u32* bits, const u32* offsets, u32* cracks) {
  const int row_words = p.row_words;
  const u32* const bits_end = bits + kept_rows(p, offsets) * row_words;
  const u32* const limit = cracks + reference::run_ends_before(offsets, p.base_at, static_cast<int>(bits_end - bits));
  EdgeWords list;
  while (bits != bits_end) {
    for (list.count = 0; bits != bits_end && list.count < EdgeWords::kRoom; bits += row_words) {
      list.add_row(bits, row_words);
    }
    for (int i = 0; i < list.count; ++i) cracks = emit_word(list.edges[i], list.first[i], cracks, limit);
  }
}

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth::simd_backend {
BERTH_SIMD_DISPATCH(run_count, (const run_count_params& p, const u32* bits, u32* offsets), (p, bits, offsets))
BERTH_SIMD_DISPATCH(run_emit, (const run_emit_params& p, const u32* bits, const u32* offsets, u32* cracks),
                    (p, bits, offsets, cracks))
}  // namespace berth::simd_backend
#endif
