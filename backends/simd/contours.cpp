// Contours: measured, listed and traced. The work is a chain of dependent loads; what counts is how few there are, how
// little is done between them, and that two contours are walked at a time, neither waiting for the other's loads.
#include <algorithm>
#include <cstring>

#include "reference/layout.hpp"
#include "simd/simd_ops.hpp"
#include "simd/workspace.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/contours.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

#include "simd/choose-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

HWY_INLINE int node_x(u32 node) { return static_cast<int>(node & 0xffffu); }
HWY_INLINE int node_step(u32 node) { return static_cast<int>(node) >> 16; }

// A walk ends on a node that an earlier one has seen, for then an earlier top is on the contour; above its top's row,
// for the same reason; and on its own first node. So no node is walked over twice, but for what two walks on one
// contour do until the later of them comes upon the earlier's first node: at any time only the first top's walk can
// come round.
HWY_INLINE bool is_end(std::ptrdiff_t id, const u32* stamps, u32 stamp, u32 row_begin) {
  return (stamps[id] <= stamp) | (static_cast<u32>(id) < row_begin);
}

/// Goes on with two walks, `a` from the earlier top, until either ends or took its share of `steps`; returns whether a
/// and whether b (2) have ended.
HWY_INLINE int go_on(const u32* nodes, u32* stamps, Walk& a, Walk& b, int steps) {
  u32* const ids_a = a.ids.data() + a.count;
  u32* const ids_b = b.ids.data() + b.count;
  u32* const nodes_a = a.nodes.data() + a.count;
  u32* const nodes_b = b.nodes.data() + b.count;
  std::ptrdiff_t at_a = a.id;
  std::ptrdiff_t at_b = b.id;
  bool end_a, end_b;
  int i = 0;
  do {
    const u32 node_a = nodes[at_a];
    const u32 node_b = nodes[at_b];
    stamps[at_b] = b.stamp;
    stamps[at_a] = a.stamp;  // the earlier one's stays where they meet
    ids_a[i] = static_cast<u32>(at_a);
    ids_b[i] = static_cast<u32>(at_b);
    nodes_a[i] = node_a;
    nodes_b[i] = node_b;
    ++i;
    at_a += node_step(node_a);
    at_b += node_step(node_b);
    end_a = is_end(at_a, stamps, a.stamp, a.row_begin);
    end_b = is_end(at_b, stamps, b.stamp, b.row_begin);
  } while (!(end_a | end_b) && i < steps);
  a.id = at_a;
  b.id = at_b;
  a.count += i;
  b.count += i;
  return (end_a ? 1 : 0) | (end_b ? 2 : 0);
}

/// The same with one.
HWY_INLINE void go_on(const u32* nodes, u32* stamps, Walk& a, int steps) {
  std::ptrdiff_t at = a.id;
  u32* const ids = a.ids.data();
  u32* const path = a.nodes.data();
  int i = a.count;
  do {
    const u32 node = nodes[at];
    stamps[at] = a.stamp;
    ids[i] = static_cast<u32>(at);
    path[i] = node;
    ++i;
    at += node_step(node);
  } while (!is_end(at, stamps, a.stamp, a.row_begin) && i < steps);
  a.id = at;
  a.count = i;
}

/// What of a walk can be summed up in any order.
struct WalkSums {
  int area;        // signed: positive for outlines
  int horizontal;  // sum of |dx|
  int width;
  u32 last;  // the greatest id
};
HWY_INLINE WalkSums sum_walk(const u32* path_ids, u32* path_nodes, int count) {
  const hn::ScalableTag<s32> lanes;
  const hn::RebindToUnsigned<decltype(lanes)> words;
  const int step = static_cast<int>(hn::Lanes(lanes));
  std::fill_n(path_nodes + count, step + 1, path_nodes[0]);  // the way back, and then nowhere
  const auto x_of = [&](const u32* node) HWY_ATTR {
    return hn::BitCast(lanes, hn::And(hn::LoadU(words, node), hn::Set(words, 0xffffu)));
  };
  auto area = hn::Zero(lanes);
  auto horizontal = hn::Zero(lanes);
  auto least = hn::Set(lanes, 0xffff);
  auto most = hn::Zero(lanes);
  auto last = hn::Zero(lanes);
  for (int i = 0; i < count; i += step) {
    const auto valid = hn::FirstN(lanes, static_cast<std::size_t>(count - i));
    const auto x = x_of(path_nodes + i);
    const auto id = hn::IfThenElseZero(valid, hn::BitCast(lanes, hn::LoadU(words, path_ids + i)));
    const auto sign = hn::Sub(hn::And(id, hn::Set(lanes, 1)), hn::Set(lanes, 1));  // 0 for ends, -1 for starts
    area = hn::Add(area, hn::IfThenElseZero(valid, hn::Sub(hn::Xor(x, sign), sign)));
    horizontal = hn::Add(horizontal, hn::Abs(hn::Sub(x_of(path_nodes + i + 1), x)));
    least = hn::Min(least, x);
    most = hn::Max(most, x);
    last = hn::Max(last, id);
  }
  return {hn::GetLane(hn::SumOfLanes(lanes, area)), hn::GetLane(hn::SumOfLanes(lanes, horizontal)),
          hn::GetLane(hn::MaxOfLanes(lanes, most)) - hn::GetLane(hn::MinOfLanes(lanes, least)),
          static_cast<u32>(hn::GetLane(hn::MaxOfLanes(lanes, last)))};
}

/// Measures the contours that begin with outlines' tops (1) or holes' (-1).
class Measurer {
 public:
  Measurer(const contour_measure_params& p, const u32* nodes, int kept, int top, WalkMemory& memory, u32* spans)
      : p_(p),
        nodes_(nodes),
        kept_(kept),
        top_(top),
        most_nodes_(std::min(p.max_side, p.height) * 5 / 2 + 4),
        memory_(memory),
        stamps_(memory.stamps.data()),
        spans_(spans) {}

  HWY_ATTR void run() {
    find_tops();
    stamp_ = memory_.take_stamps(static_cast<u32>(tops_end_ - next_));
    Walk* earlier = &memory_.walks[0];
    Walk* later = &memory_.walks[1];
    bool walking = begin(*earlier);
    while (walking && begin(*later)) {
      int ended = 0;
      while (ended == 0) {
        const int steps = most_nodes_ - std::max(earlier->count, later->count);
        ended = go_on(nodes_, stamps_, *earlier, *later, steps);
        if (earlier->count == most_nodes_) ended |= 1;
        if (later->count == most_nodes_) ended |= 2;
      }
      if ((ended & 1) != 0) finish(*earlier);
      if ((ended & 2) != 0) finish(*later);
      if (ended == 3) walking = begin(*earlier);
      if (ended == 1) std::swap(earlier, later);
    }
    if (!walking) return;
    go_on(nodes_, stamps_, *earlier, most_nodes_);
    finish(*earlier);
  }

 private:
  // A run's pair of nodes tells whether a contour may begin there. One that leads straight back is a contour of its
  // own, one row high.
  HWY_ATTR void find_tops() {
    constexpr hn::CappedTag<u32, 8> words;
    const int lanes = static_cast<int>(hn::Lanes(words));
    const u32 forth_step = static_cast<u32>(top_) & 0xffffu;
    const u32 back_step = top_ == 1 && p_.min_side > 1 ? 0xffffu : ~0u;  // ~0: no node's
    const auto forth = hn::Set(words, forth_step);
    const auto back = hn::Set(words, back_step);
    u32* out = memory_.tops.data();
    next_ = out;
    int first = 0;
    for (; first + 2 * lanes <= kept_; first += 2 * lanes) {
      auto starts = hn::Undefined(words);
      auto ends = hn::Undefined(words);
      hn::LoadInterleaved2(words, nodes_ + first, starts, ends);
      const auto tops = hn::AndNot(hn::VecFromMask(words, hn::Eq(hn::ShiftRight<16>(ends), back)),
                                   hn::VecFromMask(words, hn::Eq(hn::ShiftRight<16>(starts), forth)));
      const Choice<decltype(words)> chosen(hn::MaskFromVec(tops));
      const auto ids = hn::Add(hn::ShiftLeft<1>(hn::Iota(words, 0)), hn::Set(words, static_cast<u32>(first)));
      chosen.store(ids, out);
      out += chosen.count();
    }
    for (; first < kept_; first += 2) {
      if (nodes_[first] >> 16 == forth_step) *out++ = static_cast<u32>(first);
    }
    tops_end_ = out;
  }

  /// Begins at the next top that no walk has come by; false where there is none.
  HWY_ATTR bool begin(Walk& walk) {
    for (; next_ != tops_end_; ++next_, ++stamp_) {
      const u32 first = *next_;
      if (stamps_[first] <= stamp_) continue;
      while (memory_.row_begins[static_cast<std::size_t>(y_) + 1] <= first) ++y_;
      walk.first = static_cast<int>(first);
      walk.y = y_;
      walk.stamp = stamp_;
      walk.row_begin = memory_.row_begins[static_cast<std::size_t>(y_)];
      walk.id = static_cast<std::ptrdiff_t>(first);
      walk.count = 0;
      stamps_[first] = stamp_;
      ++next_;
      ++stamp_;
      return true;
    }
    return false;
  }

  HWY_ATTR void finish(Walk& walk) {
    if (walk.id != walk.first || walk.count < 2 * p_.min_side) return;  // two nodes a row at least
    const WalkSums sums = sum_walk(walk.ids.data(), walk.nodes.data(), walk.count);
    if (sums.area * top_ < p_.min_area || sums.horizontal > sums.width * 5 / 2 + 4) return;
    const u32* const begin = memory_.row_begins.data() + walk.y;
    const int height = static_cast<int>(std::upper_bound(begin, begin + (p_.height - walk.y), sums.last) - begin);
    if (std::min(sums.width, height) < p_.min_side || std::max(sums.width, height) > p_.max_side) return;
    if (walk.count > height * 5 / 2 + 4) return;
    const int group = walk.first / 2 / kGroupSize;
    spans_[walk.first / 2] = static_cast<u32>(walk.count) | (top_ < 0 ? CONTOUR_HOLE : 0u);
    spans_[p_.totals_at + group] += 1;
    spans_[p_.totals_at + p_.groups + 1 + group] += static_cast<u32>(walk.count);
  }

  const contour_measure_params& p_;
  const u32* nodes_;
  int kept_;
  int top_;
  int most_nodes_;
  WalkMemory& memory_;
  u32* stamps_;
  u32* spans_;
  const u32* next_ = nullptr;  // of the tops
  const u32* tops_end_ = nullptr;
  u32 stamp_ = 0;  // of the next top
  int y_ = 0;      // the row of the last begun
};

void contour_measure(Workspace& workspace, const contour_measure_params& p, const u32* nodes, const u32* offsets,
                     u32* spans) {
  WalkMemory& memory = workspace.walks;
  memory.make_room(p, static_cast<std::size_t>(std::min(p.max_side, p.height)) * 5 / 2 + 4);
  u32* const row_begins = memory.row_begins.data();
  for (int y = 0; y <= p.height; ++y) row_begins[y] = reference::run_ends_before(offsets, p.base_at, y * p.row_words);
  const u32* const fitting = std::upper_bound(row_begins, row_begins + p.height + 1, static_cast<u32>(p.capacity)) - 1;
  const int kept = static_cast<int>(*fitting);
  std::memset(spans, 0, static_cast<std::size_t>(p.groups) * kGroupSize * sizeof(u32));
  std::memset(spans + p.totals_at, 0, static_cast<std::size_t>(p.groups) * sizeof(u32));
  std::memset(spans + p.totals_at + p.groups + 1, 0, static_cast<std::size_t>(p.groups) * sizeof(u32));
  if (p.want_outer != 0) Measurer(p, nodes, kept, 1, memory, spans).run();
  if (p.want_holes != 0) Measurer(p, nodes, kept, -1, memory, spans).run();
}

void contour_collect(const contour_collect_params& p, const u32* spans, const u32* offsets, u32* contours) {
  const u32 needed = spans[p.totals_at + p.groups];
  const u32 slots = static_cast<u32>(p.max_contours);
  u32* record = contours + CONTOUR_HEADER;
  u32* const records_end = record + slots * CONTOUR_WORDS;
  const hn::CappedTag<u32, 8> words;
  const int lanes = static_cast<int>(hn::Lanes(words));
  int y = 0;
  for (int group = 0; group < p.groups && record != records_end; ++group) {
    const u32 rank = spans[p.totals_at + group];
    if (spans[p.totals_at + group + 1] == rank) continue;  // the word behind the last group is the total
    u32 start = spans[p.totals_at + p.groups + 1 + group];
    for (int run = group * kGroupSize; run < (group + 1) * kGroupSize; run += lanes) {
      u8 mask[8] = {};
      hn::StoreMaskBits(words, hn::Ne(hn::LoadU(words, spans + run), hn::Zero(words)), mask);
      for (unsigned begun = mask[0]; begun != 0 && record != records_end; begun &= begun - 1) {
        const u32 id = static_cast<u32>(run + __builtin_ctz(begun)) * 2;
        const u32 span = spans[id / 2];
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
  }
  std::fill(record, records_end, 0u);
  contours[0] = reference::run_ends_before(offsets, p.base_at, p.height * p.row_words);
  contours[1] = needed;
  contours[2] = spans[p.totals_at + p.groups + 1 + p.groups];
}

/// One contour on its way into the list of points.
struct Tracer {
  const u32* nodes = nullptr;
  std::ptrdiff_t id = 0;
  u32 y = 0;  // the point's, half pixels, as it is packed
  u32* out = nullptr;
  int left = 0;

  HWY_INLINE void begin(const u32* all_nodes, const u32* record, u32* points) {
    nodes = all_nodes;
    id = record[0];
    y = (record[2] * 2) << 16;  // a start
    out = points + record[3];
    left = static_cast<int>(record[1] & ~CONTOUR_HOLE);
  }
  HWY_INLINE void step() {
    // By the id's parity, then by whether the step changes it: up, down, to the run's end, back to a start.
    static constexpr u32 kMove[4] = {0u - (2u << 16), 2u << 16, 1u << 16, 0u - (1u << 16)};
    const u32 node = nodes[id];
    const int to_next = node_step(node);
    *out++ = (node & 0xffffu) * 2 | y;
    y += kMove[(id & 1) | ((to_next & 1) << 1)];
    id += to_next;
  }
};

// Two contours at a time: neither's next step waits for the other's.
void contour_trace(const contour_trace_params& p, const u32* nodes, const u32* contours, u32* points) {
  const u32* record = contours + CONTOUR_HEADER;
  const u32* const end = record + std::min(contours[1], static_cast<u32>(p.max_contours)) * CONTOUR_WORDS;
  Tracer a, b;
  for (;;) {
    for (; a.left == 0 && record != end; record += CONTOUR_WORDS) a.begin(nodes, record, points);
    for (; b.left == 0 && record != end; record += CONTOUR_WORDS) b.begin(nodes, record, points);
    const int both = std::min(a.left, b.left);
    if (both == 0) break;
    for (int i = 0; i < both; ++i) {
      a.step();
      b.step();
    }
    a.left -= both;
    b.left -= both;
  }
  for (; a.left > 0; --a.left) a.step();
  for (; b.left > 0; --b.left) b.step();
}

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth::simd_backend {
BERTH_SIMD_DISPATCH(contour_measure,
                    (Workspace & workspace, const contour_measure_params& p, const u32* nodes, const u32* offsets,
                     u32* spans),
                    (workspace, p, nodes, offsets, spans))
BERTH_SIMD_DISPATCH(contour_collect,
                    (const contour_collect_params& p, const u32* spans, const u32* offsets, u32* contours),
                    (p, spans, offsets, contours))
BERTH_SIMD_DISPATCH(contour_trace, (const contour_trace_params& p, const u32* nodes, const u32* contours, u32* points),
                    (p, nodes, contours, points))
}  // namespace berth::simd_backend
#endif
