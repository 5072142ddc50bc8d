// Contours: measured, listed and traced. The work is a chain of dependent loads; what counts is how few there are. Tops
// are taken in order, so a walk that meets a node some earlier walk has seen is on a contour with an earlier top and
// gives up: no node is walked over twice.
#include <algorithm>
#include <cstring>
#include <vector>

#include "reference/layout.hpp"
#include "simd/simd_ops.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/contours.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

HWY_INLINE int node_x(u32 node) { return static_cast<int>(node & 0xffffu); }
HWY_INLINE int node_step(u32 node) { return static_cast<int>(node) >> 16; }
/// +1 down from an end, -1 up from a start, 0 along the row.
HWY_INLINE int node_descent(int id, int step) { return (step & 1) != 0 ? 0 : (id & 1) * 2 - 1; }

/// The contour that begins with the top `first`: its number of nodes, or 0 when it is none of ours.
/// `seen`: nodes of contours of this kind of top that were walked over before.
HWY_INLINE u32 walk(const contour_measure_params& p, const u32* nodes, int first, int top, u8* seen) {
  const int most_nodes = std::min(p.max_side, p.height) * 5 / 2 + 4;
  const int first_x = node_x(nodes[first]);
  int id = first;
  int y = 0;
  int y_max = 0;
  int count = 0;
  int area = 0;
  int horizontal = 0;
  int before = first_x;
  int x_min = first_x;
  int x_max = first_x;
  do {
    const u32 node = nodes[id];
    const int step = node_step(node);
    if (seen[id] != 0) return 0;
    seen[id] = 1;
    const int x = node_x(node);
    x_min = std::min(x_min, x);
    x_max = std::max(x_max, x);
    area += (id & 1) != 0 ? x : -x;
    horizontal += std::abs(x - before);
    before = x;
    y += node_descent(id, step);
    y_max = std::max(y_max, y);
    if (y < 0 || ++count > most_nodes) return 0;
    id += step;
  } while (id != first);
  horizontal += std::abs(first_x - before);
  const int width = x_max - x_min;
  const int height = y_max + 1;
  const bool sized =
      area * top >= p.min_area && std::min(width, height) >= p.min_side && std::max(width, height) <= p.max_side;
  const bool convex = count <= height * 5 / 2 + 4 && horizontal <= width * 5 / 2 + 4;
  return sized && convex ? static_cast<u32>(count) | (top < 0 ? CONTOUR_HOLE : 0u) : 0u;
}

void contour_measure(const contour_measure_params& p, const u32* nodes, const u32* offsets, u32* spans) {
  const int kept = reference::kept_run_ends(offsets, p.base_at, p.height, p.row_words, p.capacity);
  std::memset(spans, 0, static_cast<std::size_t>(p.groups) * kGroupSize * sizeof(u32));
  std::memset(spans + p.totals_at, 0, static_cast<std::size_t>(p.groups) * sizeof(u32));
  std::memset(spans + p.totals_at + p.groups + 1, 0, static_cast<std::size_t>(p.groups) * sizeof(u32));
  static thread_local std::vector<u8> seen;
  const std::size_t room = static_cast<std::size_t>(p.capacity);
  if (seen.size() < 2 * room) seen.resize(2 * room);
  std::memset(seen.data(), 0, static_cast<std::size_t>(kept));
  if (p.want_holes != 0) std::memset(seen.data() + room, 0, static_cast<std::size_t>(kept));
  const auto measure = [&](int first) {
    const int top = node_step(nodes[first]);
    const u32 span = walk(p, nodes, first, top, seen.data() + (top == 1 ? 0 : room));
    if (span == 0) return;
    const int group = first / 2 / kGroupSize;
    spans[first / 2] = span;
    spans[p.totals_at + group] += 1;
    spans[p.totals_at + p.groups + 1 + group] += span & ~CONTOUR_HOLE;
  };
  // A run's pair of nodes tells whether a contour may begin there. One that leads straight back is a contour of its
  // own, one row high.
  const hn::CappedTag<u32, 8> words;
  const int lanes = static_cast<int>(hn::Lanes(words));
  const auto forth = hn::Set(words, 1);
  const auto back = hn::Set(words, 0xffffu);
  const auto too_small = hn::Set(words, p.min_side > 1 ? 0xffffu : ~0u);
  const auto want_outer = hn::Set(words, p.want_outer != 0 ? ~0u : 0u);
  const auto want_holes = hn::Set(words, p.want_holes != 0 ? ~0u : 0u);
  int first = 0;
  for (; first + 2 * lanes <= kept; first += 2 * lanes) {
    auto starts = hn::Undefined(words);
    auto ends = hn::Undefined(words);
    hn::LoadInterleaved2(words, nodes + first, starts, ends);
    starts = hn::ShiftRight<16>(starts);
    ends = hn::ShiftRight<16>(ends);
    const auto outer =
        hn::And(hn::VecFromMask(words, hn::And(hn::Eq(starts, forth), hn::Ne(ends, too_small))), want_outer);
    const auto holes = hn::And(hn::VecFromMask(words, hn::Eq(starts, back)), want_holes);
    u8 mask[8] = {};
    hn::StoreMaskBits(words, hn::MaskFromVec(hn::Or(outer, holes)), mask);
    for (unsigned tops = mask[0]; tops != 0; tops &= tops - 1) measure(first + 2 * __builtin_ctz(tops));
  }
  for (; first < kept; first += 2) {
    const int top = node_step(nodes[first]);
    if ((top == 1 && p.want_outer != 0) || (top == -1 && p.want_holes != 0)) measure(first);
  }
}

void contour_collect(const contour_collect_params& p, const u32* spans, const u32* offsets, u32* contours) {
  const u32 needed = spans[p.totals_at + p.groups];
  const u32 slots = static_cast<u32>(p.max_contours);
  u32* record = contours + CONTOUR_HEADER;
  u32* const records_end = record + slots * CONTOUR_WORDS;
  int y = 0;
  for (int group = 0; group < p.groups && record != records_end; ++group) {
    const u32 rank = spans[p.totals_at + group];
    if (spans[p.totals_at + group + 1] == rank) continue;  // the word behind the last group is the total
    u32 start = spans[p.totals_at + p.groups + 1 + group];
    for (int run = group * kGroupSize; run < (group + 1) * kGroupSize && record != records_end; ++run) {
      const u32 span = spans[run];
      if (span == 0) continue;
      const u32 id = static_cast<u32>(run) * 2;
      while (reference::run_ends_before(offsets, p.base_at, (y + 1) * p.row_words) <= id) ++y;
      const u32 count = span & ~CONTOUR_HOLE;
      record[0] = id;
      record[1] = start + count <= static_cast<u32>(p.max_points) ? span : 0u;
      record[2] = static_cast<u32>(y);
      record[3] = start;
      record += CONTOUR_WORDS;
      start += count;
    }
  }
  std::fill(record, records_end, 0u);
  contours[0] = reference::run_ends_before(offsets, p.base_at, p.height * p.row_words);
  contours[1] = needed;
  contours[2] = spans[p.totals_at + p.groups + 1 + p.groups];
}

void contour_trace(const contour_trace_params& p, const u32* nodes, const u32* contours, u32* points) {
  const u32* record = contours + CONTOUR_HEADER;
  const int slots = static_cast<int>(std::min(contours[1], static_cast<u32>(p.max_contours)));
  for (int slot = 0; slot < slots; ++slot, record += CONTOUR_WORDS) {
    const int count = static_cast<int>(record[1] & ~CONTOUR_HOLE);
    u32* out = points + record[3];
    int id = static_cast<int>(record[0]);
    int y = static_cast<int>(record[2]);
    for (int i = 0; i < count; ++i) {
      const u32 node = nodes[id];
      const int step = node_step(node);
      out[i] = static_cast<u32>(node_x(node) * 2) | static_cast<u32>(y * 2 + (id & 1)) << 16;
      y += node_descent(id, step);
      id += step;
    }
  }
}

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth::simd_backend {
BERTH_SIMD_DISPATCH(contour_measure,
                    (const contour_measure_params& p, const u32* nodes, const u32* offsets, u32* spans),
                    (p, nodes, offsets, spans))
BERTH_SIMD_DISPATCH(contour_collect,
                    (const contour_collect_params& p, const u32* spans, const u32* offsets, u32* contours),
                    (p, spans, offsets, contours))
BERTH_SIMD_DISPATCH(contour_trace, (const contour_trace_params& p, const u32* nodes, const u32* contours, u32* points),
                    (p, nodes, contours, points))
}  // namespace berth::simd_backend
#endif
