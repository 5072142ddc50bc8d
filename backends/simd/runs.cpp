// Run ends: counted, written and linked, row by row. Scalar words, but compiled for each instruction set: what is fast
// here are the bit-counting instructions that the base set lacks.
#include <cstring>

#include "reference/layout.hpp"
#include "simd/simd_ops.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/runs.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

HWY_INLINE u32 popcount(u32 word) { return static_cast<u32>(__builtin_popcount(word)); }
HWY_INLINE u32 popcount(u64 word) { return static_cast<u32>(__builtin_popcountll(word)); }

void run_count(const run_count_params& p, const u32* bits, u32* offsets) {
  const int words = p.height * p.row_words;
  u32 before = 0;  // in the group
  int word = 0;
  for (int y = 0; y < p.height; ++y) {
    u32 carry = 0;
    for (int x = 0; x < p.row_words; ++x, ++word) {
      if (word % kGroupSize == 0 && word > 0) {
        offsets[p.base_at + word / kGroupSize - 1] = before;
        before = 0;
      }
      offsets[word] = before;
      const u32 here = bits[word];
      before += popcount(here ^ ((here << 1) | carry));
      carry = here >> 31;
    }
    before += carry;
  }
  const int groups = words / kGroupSize + 1;
  for (; word < groups * kGroupSize; ++word) {
    if (word % kGroupSize == 0 && word > 0) {
      offsets[p.base_at + word / kGroupSize - 1] = before;
      before = 0;
    }
    offsets[word] = before;
  }
  offsets[p.base_at + groups - 1] = before;
}

/// 64 bits of a row from word x on; past the row's end zeros.
HWY_INLINE u64 wide_word(const u32* row, int x, int row_words) {
  u64 word = row[x];
  if (x + 1 < row_words) word |= static_cast<u64>(row[x + 1]) << 32;
  return word;
}

void run_emit(const run_emit_params& p, const u32* bits, const u32* offsets, u32* cracks) {
  constexpr int kBatch = 4;
  u32* out = cracks;
  for (int y = 0; y < p.height; ++y) {
    const u32 row_end = reference::run_ends_before(offsets, p.base_at, (y + 1) * p.row_words);
    if (row_end > static_cast<u32>(p.capacity)) return;
    u32* const end = cracks + row_end;
    if (end == out) continue;
    const u32* row = bits + static_cast<std::ptrdiff_t>(y) * p.row_words;
    u64 carry = 0;
    for (int x = 0; x < p.row_words; x += 2) {
      const u64 here = wide_word(row, x, p.row_words);
      u64 edges = here ^ ((here << 1) | carry);
      carry = here >> 63;
      const u32 first = static_cast<u32>(x * 32);
      const int count = static_cast<int>(popcount(edges));
      u32* next = out;
      // Whole batches, the last of them too long: what is too much is written again by what follows in the row. The
      // number of rounds is easier to foresee than the number of edges.
      for (int done = 0; done < count && end - next >= kBatch; done += kBatch) {
        for (int i = 0; i < kBatch; ++i) {
          next[i] = first + static_cast<u32>(__builtin_ctzll(edges | (u64{1} << 63)));
          edges &= edges - 1;
        }
        next += kBatch;
      }
      for (; edges != 0; edges &= edges - 1) *next++ = first + static_cast<u32>(__builtin_ctzll(edges));
      out += count;
    }
    // A row that ends black ends with the last crack of its padded width.
    if (out != end) *out++ = static_cast<u32>(p.row_words * 32);
  }
}

/// Overwrites the step of a node (its high half) and leaves the crack.
HWY_INLINE void set_step(u32* nodes, u32 id, u32 next) {
  const std::uint16_t step = static_cast<std::uint16_t>(next - id);
  std::memcpy(reinterpret_cast<unsigned char*>(nodes + id) + 2, &step, sizeof step);  // little-endian
}

/// Ids of the runs above and here, by their starts, for each overlap of one row in raster order.
struct Overlaps {
  static constexpr int kBatch = 4;
  int count = 0;
  // A row of 16384 px has at most every other pixel of its own.
  u32 up[8192 + kBatch];
  u32 low[8192 + kBatch];
};

// Ranks among the run starts of a word are popcounts, so the runs of an overlap are known without looking at their
// ends. Batches as in run_emit.
HWY_INLINE void find_overlaps(const u32* above, const u32* here, int row_words, u32 above_begin, u32 here_begin,
                              Overlaps& found) {
  u64 above_carry = 0;
  u64 here_carry = 0;
  u64 both_carry = 0;
  u32 up_before = above_begin;  // id of the first start in this word
  u32 low_before = here_begin;
  int count = 0;
  for (int x = 0; x < row_words; x += 2) {
    const u64 a = wide_word(above, x, row_words);
    const u64 b = wide_word(here, x, row_words);
    const u64 both = a & b;
    const u64 above_starts = a & ~((a << 1) | above_carry);
    const u64 here_starts = b & ~((b << 1) | here_carry);
    u64 overlaps = both & ~((both << 1) | both_carry);
    above_carry = a >> 63;
    here_carry = b >> 63;
    both_carry = both >> 63;
    const int end = count + static_cast<int>(popcount(overlaps));
    for (int at = count; at < end; at += Overlaps::kBatch) {
      for (int i = 0; i < Overlaps::kBatch; ++i) {
        const u64 through = overlaps ^ (overlaps - 1);  // bits up to the overlap's first
        found.up[at + i] = up_before + 2 * popcount(above_starts & through) - 2;
        found.low[at + i] = low_before + 2 * popcount(here_starts & through) - 2;
        overlaps &= overlaps - 1;
      }
    }
    count = end;
    up_before += 2 * popcount(above_starts);
    low_before += 2 * popcount(here_starts);
  }
  found.count = count;
}

HWY_INLINE void link_rows(const Overlaps& overlaps, u32* nodes) {
  u32 last_up = ~0u;
  u32 last_low = ~0u;
  for (int i = 0; i < overlaps.count; ++i) {
    const u32 up = overlaps.up[i];
    const u32 low = overlaps.low[i];
    // Which of the cases it is nobody can foresee: masks, not branches.
    const u32 first_of_low = low != last_low ? ~0u : 0u;
    const u32 again_of_up = up == last_up ? ~0u : 0u;
    const u32 from = (low & first_of_low) | ((up - 1) & ~first_of_low);
    const u32 notch = first_of_low & again_of_up;
    const u32 to = ((low - 1) & notch) | (up & ~notch);
    set_step(nodes, from, to);
    // Right for the last overlap of both; any later one writes it again.
    set_step(nodes, up + 1, low + 1);
    last_up = up;
    last_low = low;
  }
}

void run_link(const run_link_params& p, const u32* bits, const u32* offsets, const u32* cracks, u32* nodes) {
  // By default a start is followed by its end and an end by its start.
  const int kept = reference::kept_run_ends(offsets, p.base_at, p.height, p.row_words, p.capacity);
  const hn::ScalableTag<u32> words;
  const int lanes = static_cast<int>(hn::Lanes(words));
  const auto odd = hn::Ne(hn::And(hn::Iota(words, 0), hn::Set(words, 1)), hn::Zero(words));
  const auto steps = hn::IfThenElse(odd, hn::Set(words, 0xffff0000u), hn::Set(words, 0x00010000u));
  int id = 0;
  for (; id + lanes <= kept; id += lanes) {
    hn::StoreU(hn::Or(hn::LoadU(words, cracks + id), steps), words, nodes + id);
  }
  for (; id < kept; ++id) nodes[id] = cracks[id] | (id % 2 == 0 ? 0x00010000u : 0xffff0000u);

  static thread_local Overlaps kept_overlaps;
  Overlaps& overlaps = kept_overlaps;
  u32 above_begin = 0;
  u32 here_begin = reference::run_ends_before(offsets, p.base_at, p.row_words);
  for (int y = 1; y < p.height; ++y) {
    const u32 here_end = reference::run_ends_before(offsets, p.base_at, (y + 1) * p.row_words);
    if (here_end > static_cast<u32>(kept)) return;
    if (here_begin != above_begin && here_end != here_begin) {
      const u32* here = bits + static_cast<std::ptrdiff_t>(y) * p.row_words;
      find_overlaps(here - p.row_words, here, p.row_words, above_begin, here_begin, overlaps);
      link_rows(overlaps, nodes);
    }
    above_begin = here_begin;
    here_begin = here_end;
  }
}

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth::simd_backend {
BERTH_SIMD_DISPATCH(run_count, (const run_count_params& p, const u32* bits, u32* offsets), (p, bits, offsets))
BERTH_SIMD_DISPATCH(run_emit, (const run_emit_params& p, const u32* bits, const u32* offsets, u32* cracks),
                    (p, bits, offsets, cracks))
BERTH_SIMD_DISPATCH(run_link,
                    (const run_link_params& p, const u32* bits, const u32* offsets, const u32* cracks, u32* nodes),
                    (p, bits, offsets, cracks, nodes))
}  // namespace berth::simd_backend
#endif
