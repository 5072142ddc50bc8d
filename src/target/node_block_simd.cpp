// Sums of a place's blocks, one, two or four rows a vector: the definition's integers (node_block.cpp) on every
// instruction set.
#include "target/node_block.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "target/node_block_simd.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>
//
#include "target/node_sums-inl.hpp"

HWY_BEFORE_NAMESPACE();
namespace berth::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR
void add_blocks(View2D<const u8> image, const EdgePieces& edge, const NodeBlocks& blocks, PlaceSums& sums) {
  for (std::size_t i = 0; i < blocks.count; ++i) {
    reference::add_block(image, edge, blocks.place, blocks.blocks[i], sums);
  }
}
#else

HWY_INLINE V16 all(int value) { return hn::Set(D16(), static_cast<std::int16_t>(value)); }
HWY_INLINE V16 product(V16 a, V16 b) { return hn::MulFixedPoint15(a, b); }
template <class Values>
HWY_INLINE V16 table(const Values& values) {
  return hn::BitCast(D16(), hn::LoadDup128(Bytes(), reinterpret_cast<const std::uint8_t*>(values.data())));
}
HWY_INLINE V16 look_up(V16 table, V16 bytes) {
  return hn::BitCast(D16(), hn::TableLookupBytes(hn::BitCast(Bytes(), table), hn::BitCast(Bytes(), bytes)));
}
// 256 times the byte that the upper half of an entry of `bytes` says.
HWY_INLINE V16 look_up_256(V16 table, V16 bytes) {
  return hn::BitCast(D16(), hn::TableLookupBytesOr0(hn::BitCast(Bytes(), table), hn::BitCast(Bytes(), bytes)));
}
// Of the even and of the odd columns of a row, in 16-bit pairs: dx and dx²; dx and nothing. Of rows, every one and
// every second: dy and dy².
struct Offsets {
  alignas(64) std::int16_t columns[2][8] = {}, linear[2][8] = {};
  alignas(64) std::int16_t rows[2][8][8] = {};
  constexpr Offsets() {
    for (int i = 0; i < 8; ++i) {
      const int dx = i - 4, pair = i / 2 * 2;
      columns[i % 2][pair] = linear[i % 2][pair] = static_cast<std::int16_t>(dx);
      columns[i % 2][pair + 1] = static_cast<std::int16_t>(dx * dx);
      for (int step = 1; step <= 2; ++step) {
        const int dy = i * step - 4;
        for (int k = 0; k < 8 && dy < 4; k += 2) {
          rows[step - 1][i][k] = static_cast<std::int16_t>(dy);
          rows[step - 1][i][k + 1] = static_cast<std::int16_t>(dy * dy);
        }
      }
    }
  }
};
constexpr Offsets kOffsets;

// To each lane the products of its own two entries.
HWY_INLINE V32 add_pairs(V32 sums, V16 a, V16 b) {
#if HWY_ARCH_X86
  return add_products(sums, a, b);  // pmaddwd's order
#else
  const auto first = [](V16 v) HWY_ATTR { return hn::ShiftRight<16>(hn::ShiftLeft<16>(hn::BitCast(D32(), v))); };
  const auto second = [](V16 v) HWY_ATTR { return hn::ShiftRight<16>(hn::BitCast(D32(), v)); };
  return hn::Add(sums, hn::Add(hn::Mul(first(a), first(b)), hn::Mul(second(a), second(b))));
#endif
}

// A coordinate of rows' pixels, those of even and of odd columns in 32-bit lanes.
struct Coordinates {
  V32 even, odd;
  // Of both in 16 bits, in order.
  HWY_INLINE V16 low_halves() const {
    return hn::OddEven(hn::BitCast(D16(), hn::ShiftLeft<16>(odd)), hn::BitCast(D16(), even));
  }
  HWY_INLINE V16 high_halves() const {
    return hn::OddEven(hn::BitCast(D16(), odd), hn::BitCast(D16(), hn::ShiftRight<16>(even)));
  }
  // Entries -1 where it is inside.
  HWY_INLINE V16 inside(std::int32_t first, std::int32_t last) const {
    const V32 before = hn::Set(D32(), first), end = hn::Set(D32(), last);
    const auto in = [&](V32 at) HWY_ATTR {
      return hn::BitCast(D16(), hn::VecFromMask(D32(), hn::AndNot(hn::Lt(at, before), hn::Lt(at, end))));
    };
    return hn::OddEven(in(odd), in(even));
  }
};

// Its part by columns, and in 16 bits, as NodeCoordinate promises, the factors of dy and dy² there.
class Coordinate {
 public:
  explicit HWY_INLINE Coordinate(const NodeCoordinate& q) {
    const auto& [x, y, xx, xy, yy] = q.slopes;
    for (std::size_t odd = 0; odd < 2; ++odd) {
      const V16 columns = hn::LoadDup128(D16(), kOffsets.columns[odd]);
      const V16 linear = hn::LoadDup128(D16(), kOffsets.linear[odd]);
      start_[odd] = add_pairs(hn::Set(D32(), q.start), pair(x, xx), columns);
      down_[odd] = hn::Add(pair(y, yy), hn::Mul(all(xy), linear));
    }
  }
  HWY_INLINE Coordinates at(int row_step, int row) const {
    const V16 rows = hn::Load(D16(), kOffsets.rows[row_step - 1][row]);
    return {add_pairs(start_[0], down_[0], rows), add_pairs(start_[1], down_[1], rows)};
  }

 private:
  static HWY_INLINE V16 pair(int first, int second) {
    const std::uint32_t both = (static_cast<std::uint32_t>(second) << 16) | (static_cast<std::uint32_t>(first) & 65535);
    return hn::BitCast(D16(), hn::Set(D32(), static_cast<std::int32_t>(both)));
  }
  V32 start_[2];
  V16 down_[2];
};

struct Edge {
  V16 level, slope, spread;
};

struct Pieces {
  explicit HWY_INLINE Pieces(const EdgePieces& edge)
      : c0(table(edge[0])), c1(table(edge[1])), c2(table(edge[2])), c3(table(edge[3])) {}
  HWY_INLINE Edge edge(V16 behind, V16 gain, int doublings) const {
    V16 t = product(behind, gain);
    for (int k = 0; k < doublings; ++k) t = hn::SaturatedAdd(t, t);
    t = hn::Max(t, all(-32767));
    const V16 size = hn::Abs(t);
    const V16 piece = hn::ShiftRight<12>(size);
    // Bytes 2 k and 2 k + 1 of each entry k.
    const V16 bytes = hn::Add(hn::Mul(piece, all(0x0202)), all(0x0100));
    const V16 f = hn::ShiftLeft<3>(hn::And(size, all(4095)));
    const V16 cubic = product(look_up(c3, bytes), f);
    const V16 square = hn::Add(cubic, look_up(c2, bytes));
    const V16 linear = hn::Add(product(square, f), look_up(c1, bytes));
    const V16 value = hn::Add(product(linear, f), look_up(c0, bytes));
    const V16 sign = hn::ShiftRight<15>(t);
    const V16 half_slope = hn::Add(linear, product(hn::Add(square, cubic), f));
    const V16 slope = hn::Add(half_slope, half_slope);
    return {hn::Sub(hn::Xor(value, sign), sign), slope, product(t, slope)};
  }

  V16 c0, c1, c2, c3;
};

// Level and steps, q9, to a scale kShift bits less fine: of a vector's rows, then of the next.
template <int kShift>
class Tone {
 public:
  HWY_INLINE Tone(std::int32_t level, const std::array<std::int16_t, 2>& step, V16 dy, int next)
      : base_(all(level >> kShift)), next_(all(step[1] * next)) {
    constexpr int kHalf = 1 << (kShift - 1);
    alignas(16) static constexpr std::int16_t kColumns[8] = {-4, -3, -2, -1, 0, 1, 2, 3};
    const V16 across = hn::Mul(hn::LoadDup128(D16(), kColumns), all(step[0]));
    row_ = hn::Add(hn::Add(all((level & (2 * kHalf - 1)) + kHalf), across), hn::Mul(all(step[1]), dy));
  }
  HWY_INLINE V16 here() const { return hn::Add(base_, hn::ShiftRight<kShift>(row_)); }
  HWY_INLINE void go_on() { row_ = hn::Add(row_, next_); }

 private:
  V16 base_, next_, row_;
};

template <std::size_t kRows>
HWY_INLINE auto greys(View2D<const u8> image, int x, int y, int row_step) {
  const hn::CappedTag<std::uint8_t, 8 * kRows> d;
  if constexpr (kRows == 1) {
    return hn::LoadU(d, image.row(y) + x);
  } else {
    constexpr std::size_t kHalf = kRows / 2;
    return hn::Combine(d, greys<kHalf>(image, x, y + static_cast<int>(kHalf) * row_step, row_step),
                       greys<kHalf>(image, x, y, row_step));
  }
}

// Compares blocks with the model and keeps their pixels' channels.
class Looker {
 public:
  HWY_INLINE Looker(const EdgePieces& edge, const NodePlace& place)
      : pieces_(edge),
        place_(place),
        gain_u_(all(place.gain_u)),
        gain_v_(all(place.gain_v)),
        correlation_(all(place.correlation)),
        half_square_(all(place.half_square)),
        tone_curve_(all(place.tone)),
        most_(all(place.most_residual)) {}

  HWY_INLINE void look(View2D<const u8> image, const NodeBlock& m, Stored& stored) {
    const D16 d16;
    const Coordinate along_columns(m.u), along_rows(m.v);
    const V16 even_nodes = table(m.nodes.even), u_nodes = table(m.nodes.by_u), v_nodes = table(m.nodes.by_v),
              both_nodes = table(m.nodes.both), known_nodes = table(m.nodes.known);
    const V16 zero = hn::Zero(d16), one = all(1);
    const int row_step = place_.row_step;
    alignas(64) static constexpr std::int16_t kRow[32] = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1,
                                                          2, 2, 2, 2, 2, 2, 2, 2, 3, 3, 3, 3, 3, 3, 3, 3};
    const V16 dy = hn::Add(all(-4), hn::Mul(hn::Load(d16, kRow), all(row_step)));
    const int next = row_step * static_cast<int>(kVectorRows);
    Tone<5> darks(m.dark, m.dark_step, dy, next);
    Tone<3> contrasts(m.contrast, m.contrast_step, dy, next);
    for (int row = 0; row < 8 / row_step; row += static_cast<int>(kVectorRows)) {
      const Coordinates at_u = along_columns.at(row_step, row), at_v = along_rows.at(row_step, row);
      const V16 nodes = hn::Add(at_u.high_halves(), hn::ShiftLeft<2>(at_v.high_halves()));
      const V16 bytes = hn::Or(hn::ShiftLeft<8>(nodes), all(0x80));
      const Edge u = pieces_.edge(hn::Xor(at_u.low_halves(), all(-32768)), gain_u_, place_.doublings_u);
      const Edge v = pieces_.edge(hn::Xor(at_v.low_halves(), all(-32768)), gain_v_, place_.doublings_v);

      const V16 grey = hn::PromoteTo(d16, greys<kVectorRows>(image, m.x - 4, m.y - 4 + row * row_step, row_step));
      V16 seen = hn::VecFromMask(d16, hn::Or(hn::Eq(grey, zero), hn::Eq(grey, all(255))));
      if (m.whole && m.all_known) {
        saturated_ = hn::Add(saturated_, seen);
        seen = hn::Not(seen);
      } else {
        V16 in = hn::And(at_u.inside(m.u_first, m.u_last), at_v.inside(m.v_first, m.v_last));
        in = hn::And(in, hn::VecFromMask(d16, hn::Lt(look_up_256(known_nodes, bytes), zero)));
        saturated_ = hn::Add(saturated_, hn::And(seen, in));
        seen = hn::AndNot(seen, in);
      }

      const V16 both = look_up_256(both_nodes, bytes), by_v = look_up_256(v_nodes, bytes);
      const V16 along_u = hn::Add(look_up_256(u_nodes, bytes), product(both, v.level));
      const V16 along_v = hn::Add(by_v, product(both, u.level));
      const V16 plain =
          hn::Add(look_up_256(even_nodes, bytes), hn::Add(product(by_v, v.level), product(u.level, along_u)));
      const V16 first = product(both, product(u.slope, v.slope));
      const V16 second = product(both, hn::ShiftLeft<4>(product(u.spread, v.spread)));
      const V16 level = hn::Add(plain, hn::Add(product(correlation_, first), product(half_square_, second)));
      const V16 doubled = hn::Add(level, level);
      const V16 tone = product(doubled, hn::Sub(all(16384), doubled));
      const V16 shown = hn::Add(level, product(tone_curve_, tone));
      const V16 steep = hn::Add(all(8192), product(tone_curve_, hn::Sub(all(8192), doubled)));
      const V16 predicted = hn::Add(darks.here(), product(contrasts.here(), shown));
      darks.go_on();
      contrasts.go_on();
      V16 residual = hn::Sub(hn::ShiftLeft<4>(grey), predicted);
      seen = hn::AndNot(hn::VecFromMask(d16, hn::Gt(hn::Abs(residual), most_)), seen);
      residual = hn::And(residual, seen);

      const V16 slope_u = hn::And(product(product(along_u, u.slope), steep), seen);
      const V16 slope_v = hn::And(product(product(along_v, v.slope), steep), seen);
      const V16 is_flat = hn::VecFromMask(d16, hn::Eq(hn::Or(slope_u, slope_v), zero));
      const V16 on_edge = hn::AndNot(is_flat, seen), is_even = hn::And(is_flat, seen);
      on_edges_ = hn::Add(on_edges_, on_edge);
      even_ = hn::Add(even_, is_even);
      // A block's row is 128 bits, whose neighbours to the left are one entry below.
      const V16 even_residual = hn::And(residual, is_even);
      pairs_ = hn::Add(pairs_, hn::And(is_even, hn::ShiftLeftLanes<1>(is_even)));
      even_squares_ = add_products(even_squares_, even_residual, even_residual);
      pair_products_ = add_products(pair_products_, even_residual, hn::ShiftLeftLanes<1>(even_residual));

      // Stored as both, and the one that it is not is written over: whether a vector sees an edge is known last of all,
      // and cannot be foreseen.
      const V16 ones = hn::And(seen, one), levels = hn::And(product(shown, all(8192)), seen);
      const std::size_t at_even = kLanes * stored.even_vectors, at_edge = kLanes * stored.edge_vectors;
      hn::Store(ones, d16, stored.even[0] + at_even);
      hn::Store(levels, d16, stored.even[1] + at_even);
      hn::Store(residual, d16, stored.even[2] + at_even);
      const auto put = [&](Channel channel, V16 value)
                           HWY_ATTR { hn::Store(value, d16, stored.edges[channel] + at_edge); };
      const auto steeper = [&](V16 value) HWY_ATTR { return hn::And(product(value, steep), on_edge); };
      put(kOne, ones);
      put(kLevel, levels);
      put(kTone, hn::And(product(tone, all(8192)), on_edge));
      put(kSlopeU, slope_u);
      put(kSlopeV, slope_v);
      put(kSpreadU, steeper(hn::ShiftLeft<2>(product(along_u, u.spread))));
      put(kSpreadV, steeper(hn::ShiftLeft<2>(product(along_v, v.spread))));
      put(kTwist, steeper(hn::Add(first, product(correlation_, second))));
      put(kResidual, residual);
      const std::size_t is_even_vector = hn::AllTrue(d16, hn::Eq(on_edge, zero)) ? 1 : 0;
      stored.even_vectors += is_even_vector;
      stored.edge_vectors += 1 - is_even_vector;
    }
  }

  HWY_INLINE void add_counts_to(LaneSums& sums) const {
    const auto count = [&](PlaceSums::Row row, V16 counts)
                           HWY_ATTR { sums.add(row, add_products(hn::Zero(D32()), counts, all(-1))); };
    count(PlaceSums::kPixels, hn::Add(on_edges_, even_));
    count(PlaceSums::kOnEdges, on_edges_);
    count(PlaceSums::kSaturated, saturated_);
    count(PlaceSums::kEven, even_);
    count(PlaceSums::kPairs, pairs_);
    sums.add(PlaceSums::kEvenSquares, even_squares_);
    sums.add(PlaceSums::kPairProducts, pair_products_);
  }

 private:
  const Pieces pieces_;
  const NodePlace& place_;
  const V16 gain_u_, gain_v_, correlation_, half_square_, tone_curve_, most_;
  // Minus counts.
  V16 on_edges_ = all(0), saturated_ = all(0), even_ = all(0), pairs_ = all(0);
  V32 even_squares_ = hn::Zero(D32()), pair_products_ = hn::Zero(D32());
};

HWY_ATTR void add_blocks(View2D<const u8> image, const EdgePieces& edge, const NodeBlocks& blocks, PlaceSums& sums) {
  Stored stored;
  LaneSums lanes;
  Looker looker(edge, blocks.place);
  for (std::size_t i = 0; i < blocks.count; ++i) looker.look(image, blocks.blocks[i], stored);
  looker.add_counts_to(lanes);
  sum_edges(stored, lanes);
  sum_even(stored, lanes);
  lanes.add_totals_to(sums);
}
#endif

}  // namespace berth::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth {
HWY_EXPORT(add_blocks);
void add_blocks(View2D<const u8> image, const EdgePieces& edge, const NodeBlocks& blocks, PlaceSums& sums) {
  HWY_DYNAMIC_DISPATCH(add_blocks)(image, edge, blocks, sums);
}
}  // namespace berth
#endif
