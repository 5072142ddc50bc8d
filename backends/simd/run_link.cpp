// Run ends linked. The overlaps of the runs of two rows, in raster order, tell all: what links to what depends on two
// neighbouring overlaps only.
#include <algorithm>
#include <cstring>

#include "simd/simd_ops.hpp"
#include "simd/workspace.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/run_link.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

#include "simd/bit_rows-inl.hpp"
#include "simd/choose-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {

/// The id of the last run end before each of the words from `word` on; a vector has words of two groups at most.
HWY_INLINE RowWords last_before(const u32* offsets, int base_at, int word) {
  const RowTag words;
  const u32* const base = offsets + base_at + word / kGroupSize;
  const auto within = hn::FirstN(words, static_cast<std::size_t>(kGroupSize - word % kGroupSize));
  const auto bases = hn::IfThenElse(within, hn::Set(words, base[0] - 1), hn::Set(words, base[1] - 1));
  return hn::Add(hn::LoadU(words, offsets + word), bases);
}

/// A row as the upper one of the next: its bits, where they change, and the last run ends before its words.
struct RowAbove {
  u32 bits[kMaxRowWords + kRowSlack];
  u32 changes[kMaxRowWords + kRowSlack];
  u32 before[kMaxRowWords + kRowSlack];
};

/// Adds the words of a row and the one above to the list of `count`; returns how many it then has. `word`: the first of
/// the row. `above` becomes this row.
HWY_NOINLINE int list_overlaps(const u32* row, int row_words, const u32* offsets, int base_at, int word, int count,
                               RowAbove& above, OverlapWords& list) {
  const RowTag words;
  const int lanes = row_lanes();
  RightMover right_here, right_both;
  for (int x = 0; x < row_words; x += lanes) {
    const auto here = row_words_at(row, x, row_words);
    const auto both = hn::And(here, hn::LoadU(words, above.bits + x));
    const auto begin = hn::AndNot(right_both.moved(both), both);
    const auto changes = hn::Xor(here, right_here.moved(here));
    const auto before = last_before(offsets, base_at, word + x);
    const Choice<RowTag> some(hn::Ne(begin, hn::Zero(words)));
    some.store(begin, list.begins + count);
    some.store(hn::LoadU(words, above.changes + x), list.above + count);
    some.store(changes, list.here + count);
    some.store(hn::LoadU(words, above.before + x), list.up + count);
    some.store(before, list.low + count);
    hn::StoreU(here, words, above.bits + x);
    hn::StoreU(changes, words, above.changes + x);
    hn::StoreU(before, words, above.before + x);
    count += some.count();
  }
  return count;
}

/// The overlaps that begin in a list of words: returns how many. A run's start is the last change at or before an
/// overlap's first pixel.
HWY_NOINLINE int find_overlaps(const OverlapWords& list, int listed, Overlaps& overlaps) {
  u32* up = overlaps.up + 1;
  u32* low = overlaps.low + 1;
  for (int i = 0; i < listed; ++i) {
    u32 begins = list.begins[i];
    const u32 above = list.above[i];
    const u32 here = list.here[i];
    const u32 up_before = list.up[i];
    const u32 low_before = list.low[i];
    const int count = static_cast<int>(popcount(begins));
    // Too many of them at the end of a batch, which what follows writes over: seldom more than one batch to a word.
    for (int at = 0; at < count; at += Overlaps::kBatch) {
      for (int k = 0; k < Overlaps::kBatch; ++k) {
        const u32 through = begins ^ (begins - 1);
        up[at + k] = up_before + popcount(above & through);
        low[at + k] = low_before + popcount(here & through);
        begins &= begins - 1;
      }
    }
    up += count;
    low += count;
  }
  return static_cast<int>(up - overlaps.up) - 1;
}

/// Overwrites the step of a node (its high half) and leaves the crack.
HWY_INLINE void set_step(u32* nodes, u32 id, u32 step) {
  const std::uint16_t half = static_cast<std::uint16_t>(step);
  std::memcpy(reinterpret_cast<unsigned char*>(nodes + id) + 2, &half, sizeof half);  // little-endian
}

// From one overlap to the next the contour
//   turns back at the end of the upper run, if another of its row lies over the same lower run: to that one's start;
//   turns back at the start of the lower run, if it lies under the same upper run: to the end of the one before it;
//   or else goes down from the end of the upper run before, and up from the start of the lower one here.
// Which of these it is nobody can foresee: all is written, and what was wrong is written again by the next overlap.
HWY_NOINLINE void link(Overlaps& overlaps, int count, u32* nodes) {
  const RowTag words;
  const int lanes = row_lanes();
  const u32* up = overlaps.up + 1;
  const u32* low = overlaps.low + 1;
  u32 down[kRowSlack];
  u32 from[kRowSlack];
  u32 to[kRowSlack];
  const auto one = hn::Set(words, 1);
  for (int i = 0; i < count; i += lanes) {
    const auto upper = hn::LoadU(words, up + i);
    const auto lower = hn::LoadU(words, low + i);
    const auto same_up = hn::Eq(upper, hn::LoadU(words, up + i - 1));
    const auto same_low = hn::Eq(lower, hn::LoadU(words, low + i - 1));
    const auto source = hn::IfThenElse(same_low, hn::Sub(upper, one), lower);
    const auto target = hn::IfThenElse(same_up, hn::Sub(lower, one), upper);
    hn::StoreU(source, words, from);
    hn::StoreU(hn::Sub(target, source), words, to);
    hn::StoreU(hn::Sub(lower, upper), words, down);
    const int size = std::min(lanes, count - i);
    for (int k = 0; k < size; ++k) {
      set_step(nodes, from[k], to[k]);
      set_step(nodes, up[i + k] + 1, down[k]);
    }
  }
  overlaps.up[0] = up[count - 1];
  overlaps.low[0] = low[count - 1];
}

void run_link(Workspace& workspace, const run_link_params& p, const u32* bits, const u32* offsets, const u32* cracks,
              u32* nodes) {
  const int row_words = p.row_words;
  const int base_at = p.base_at;
  const int rows = kept_rows(p, offsets);
  // By default a start is followed by its end and an end by its start.
  const int kept = static_cast<int>(reference::run_ends_before(offsets, base_at, rows * row_words));
  const RowTag words;
  const int lanes = row_lanes();
  const auto odd = hn::Ne(hn::And(hn::Iota(words, 0), hn::Set(words, 1)), hn::Zero(words));
  const auto steps = hn::IfThenElse(odd, hn::Set(words, 0xffff0000u), hn::Set(words, 0x00010000u));
  int id = 0;
  // Steps that begin with an even id, which not every vector does where it is a single word.
  for (; lanes > 1 && id + lanes <= kept; id += lanes) {
    hn::StoreU(hn::Or(hn::LoadU(words, cracks + id), steps), words, nodes + id);
  }
  for (; id < kept; ++id) nodes[id] = cracks[id] | (id % 2 == 0 ? 0x00010000u : 0xffff0000u);

  OverlapWords& list = workspace.overlap_words;
  Overlaps& overlaps = workspace.overlaps;
  overlaps.up[0] = overlaps.low[0] = ~0u;
  RowAbove above = {};  // white lies above the first row
  for (int y = 0; y < rows;) {
    int listed = 0;
    for (; y < rows && listed < OverlapWords::kRoom; ++y) {
      const int word = y * row_words;
      listed = list_overlaps(bits + word, row_words, offsets, base_at, word, listed, above, list);
    }
    const int count = find_overlaps(list, listed, overlaps);
    if (count > 0) link(overlaps, count, nodes);
  }
}

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth::simd_backend {
BERTH_SIMD_DISPATCH(run_link,
                    (Workspace & workspace, const run_link_params& p, const u32* bits, const u32* offsets,
                     const u32* cracks, u32* nodes),
                    (workspace, p, bits, offsets, cracks, nodes))
}  // namespace berth::simd_backend
#endif
