// A block's sums, one or two of its rows a vector: the definition's integers (node_block.cpp) on every instruction set.
#include <algorithm>

#include "target/node_block.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "target/node_block_simd.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace berth::HWY_NAMESPACE {

#if HWY_TARGET == HWY_SCALAR
void add_block(View2D<const u8> image, const EdgePieces& edge, const NodeBlock& block, PlaceSums& sums) {
  reference::add_block(image, edge, block, sums);
}
#else

namespace hn = hwy::HWY_NAMESPACE;

using D16 = hn::CappedTag<std::int16_t, 16>;
using D32 = hn::RepartitionToWide<D16>;
using V16 = hn::Vec<D16>;
using V32 = hn::Vec<D32>;
using Bytes = hn::Repartition<std::uint8_t, D16>;
constexpr std::size_t kLanes = hn::MaxLanes(D16());
constexpr std::size_t kVectorRows = kLanes / 8;
static_assert(kVectorRows == 1 || kVectorRows == 2, "a vector is one row or two");

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

// A coordinate's quadratic for the left and the right half of rows: in 32-bit lanes, four pixels of one row, then of
// the next; packed to 16 bits, both halves are whole rows.
class Coordinate {
 public:
  explicit HWY_INLINE Coordinate(const std::array<std::int32_t, 6>& q) : yy_(hn::Set(D32(), q[5])) {
    alignas(16) static constexpr std::int32_t kColumns[8] = {-4, -3, -2, -1, 0, 1, 2, 3};
    const auto same = [](std::int32_t value) HWY_ATTR { return hn::Set(D32(), value); };
    for (std::size_t half = 0; half < 2; ++half) {
      const V32 dx = hn::LoadDup128(D32(), kColumns + 4 * half);
      start_[half] = hn::Add(same(q[0]), hn::Mul(dx, hn::Add(same(q[1]), hn::Mul(dx, same(q[3])))));
      across_[half] = hn::Add(same(q[2]), hn::Mul(dx, same(q[4])));
    }
  }
  HWY_INLINE V32 at(std::size_t half, V32 dy) const {
    return hn::Add(start_[half], hn::Mul(dy, hn::Add(across_[half], hn::Mul(yy_, dy))));
  }

 private:
  V32 start_[2], across_[2], yy_;
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

// Level and steps, q9, to a scale kShift bits less fine.
template <int kShift>
class Tone {
 public:
  HWY_INLINE Tone(std::int32_t level, const std::array<std::int16_t, 2>& step)
      : base_(all(level >> kShift)), down_(all(step[1])) {
    constexpr int kHalf = 1 << (kShift - 1);
    alignas(16) static constexpr std::int16_t kColumns[8] = {-4, -3, -2, -1, 0, 1, 2, 3};
    row_ = hn::Add(all((level & (2 * kHalf - 1)) + kHalf), hn::Mul(hn::LoadDup128(D16(), kColumns), all(step[0])));
  }
  HWY_INLINE V16 at(V16 dy) const { return hn::Add(base_, hn::ShiftRight<kShift>(hn::Add(row_, hn::Mul(down_, dy)))); }

 private:
  V16 base_, down_, row_;
};

HWY_INLINE V16 greys(View2D<const u8> image, int x, int y, int row_step) {
  if constexpr (kVectorRows == 1) {
    const hn::Rebind<std::uint8_t, D16> d8;
    return hn::PromoteTo(D16(), hn::LoadU(d8, image.row(y) + x));
  } else {
    const hn::Rebind<std::uint8_t, D16> d8;
    const hn::Half<decltype(d8)> row;
    const auto upper = hn::LoadU(row, image.row(y) + x), lower = hn::LoadU(row, image.row(y + row_step) + x);
    return hn::PromoteTo(D16(), hn::Combine(d8, lower, upper));
  }
}

// Entries -1 where a coordinate's half rows are inside.
HWY_INLINE V16 inside(V32 left, V32 right, std::int32_t first, std::int32_t last) {
  const V32 before = hn::Set(D32(), first), end = hn::Set(D32(), last);
  const auto in = [&](V32 at)
                      HWY_ATTR { return hn::VecFromMask(D32(), hn::AndNot(hn::Lt(at, before), hn::Lt(at, end))); };
  return hn::ReorderDemote2To(D16(), in(left), in(right));
}

HWY_INLINE V32 add_products(V32 sums, V16 a, V16 b) {
  V32 more = hn::Zero(D32());
  sums = hn::ReorderWidenMulAccumulate(D32(), a, b, sums, more);
  return hn::Add(sums, more);
}

HWY_INLINE void add_to(std::array<std::int32_t, PlaceSums::kLanes>& row, V32 sums) {
  hn::Store(hn::Add(hn::Load(D32(), row.data()), sums), D32(), row.data());
}

// Pixels' channels, vector by vector: of those that see edges, and three of those that see none.
struct Stored {
  alignas(32) std::int16_t edges[kChannels][64];
  alignas(32) std::int16_t even[3][64];
  std::size_t edge_vectors = 0, even_vectors = 0;
};

template <std::size_t kVectors>
HWY_INLINE void sum_edges(const Stored& stored, PlaceSums& sums) {
  std::size_t k = 0;
  for (std::size_t a = 0; a < kChannels; ++a) {
    V16 left[kVectors];
    for (std::size_t i = 0; i < kVectors; ++i) left[i] = hn::Load(D16(), stored.edges[a] + i * kLanes);
    for (std::size_t b = a; b < kChannels; ++b, ++k) {
      V32 sum = hn::Load(D32(), sums.lanes[k].data());
      for (std::size_t i = 0; i < kVectors; ++i) {
        sum = add_products(sum, left[i], hn::Load(D16(), stored.edges[b] + i * kLanes));
      }
      hn::Store(sum, D32(), sums.lanes[k].data());
    }
  }
}

HWY_INLINE void sum_even(const Stored& stored, PlaceSums& sums) {
  constexpr std::size_t kRow[6] = {0, 1, kResidual, kChannels, kChannels + kResidual - 1, kProducts - 1};
  std::size_t k = 0;
  for (std::size_t a = 0; a < 3; ++a) {
    for (std::size_t b = a; b < 3; ++b, ++k) {
      V32 sum = hn::Load(D32(), sums.lanes[kRow[k]].data());
      for (std::size_t i = 0; i < stored.even_vectors; ++i) {
        sum = add_products(sum, hn::Load(D16(), stored.even[a] + i * kLanes),
                           hn::Load(D16(), stored.even[b] + i * kLanes));
      }
      hn::Store(sum, D32(), sums.lanes[kRow[k]].data());
    }
  }
}

HWY_ATTR void add_block(View2D<const u8> image, const EdgePieces& edge, const NodeBlock& m, PlaceSums& sums) {
  const D16 d16;
  const D32 d32;
  const Pieces pieces(edge);
  const Coordinate along_columns(m.u), along_rows(m.v);
  const Tone<5> darks(m.dark, m.dark_step);
  const Tone<3> contrasts(m.contrast, m.contrast_step);
  const V16 even_nodes = table(m.nodes.even), u_nodes = table(m.nodes.by_u), v_nodes = table(m.nodes.by_v),
            both_nodes = table(m.nodes.both), known_nodes = table(m.nodes.known);
  const V16 gain_u = all(m.gain_u), gain_v = all(m.gain_v);
  const V16 correlation = all(m.correlation), half_square = all(m.half_square), tone_curve = all(m.tone);
  const V16 zero = hn::Zero(d16), one = all(1), most = all(m.most_residual);
  alignas(32) static constexpr std::int16_t kSecond16[16] = {0, 0, 0, 0, 0, 0, 0, 0, 1, 1, 1, 1, 1, 1, 1, 1};
  alignas(32) static constexpr std::int32_t kSecond32[8] = {0, 0, 0, 0, 1, 1, 1, 1};
  V16 dy16 = hn::Add(all(-4), hn::Mul(hn::Load(d16, kSecond16), all(m.row_step)));
  V32 dy32 = hn::Add(hn::Set(d32, -4), hn::Mul(hn::Load(d32, kSecond32), hn::Set(d32, m.row_step)));
  const int next = m.row_step * static_cast<int>(kVectorRows);
  // Entries up to minus 8: minus counts.
  V16 on_edges = zero, saturated = zero, even = zero, pairs = zero, pixels = zero;
  V32 even_squares = hn::Zero(d32), pair_products = hn::Zero(d32);
  Stored stored;

  for (int dy = -4; dy < 4; dy += next) {
    const V32 u_left = along_columns.at(0, dy32), u_right = along_columns.at(1, dy32);
    const V32 v_left = along_rows.at(0, dy32), v_right = along_rows.at(1, dy32);
    const auto node = [](V32 u, V32 v)
                          HWY_ATTR { return hn::Add(hn::ShiftRight<16>(u), hn::ShiftLeft<2>(hn::ShiftRight<16>(v))); };
    const auto low_half = [](V32 left, V32 right) HWY_ATTR {
      const auto low = [](V32 x) HWY_ATTR { return hn::ShiftRight<16>(hn::ShiftLeft<16>(x)); };
      return hn::Xor(hn::ReorderDemote2To(D16(), low(left), low(right)), all(-32768));
    };
    const V16 nodes = hn::ReorderDemote2To(d16, node(u_left, v_left), node(u_right, v_right));
    const V16 bytes = hn::Or(hn::ShiftLeft<8>(nodes), all(0x80));
    const Edge u = pieces.edge(low_half(u_left, u_right), gain_u, m.doublings_u);
    const Edge v = pieces.edge(low_half(v_left, v_right), gain_v, m.doublings_v);

    const V16 grey = greys(image, m.x - 4, m.y + dy, m.row_step);
    V16 seen = hn::VecFromMask(d16, hn::Or(hn::Eq(grey, zero), hn::Eq(grey, all(255))));
    if (m.whole && m.all_known) {
      saturated = hn::Add(saturated, seen);
      seen = hn::Not(seen);
    } else {
      V16 in = hn::And(inside(u_left, u_right, m.u_first, m.u_last), inside(v_left, v_right, m.v_first, m.v_last));
      in = hn::And(in, hn::VecFromMask(d16, hn::Lt(look_up_256(known_nodes, bytes), zero)));
      saturated = hn::Add(saturated, hn::And(seen, in));
      seen = hn::AndNot(seen, in);
    }

    const V16 both = look_up_256(both_nodes, bytes), by_v = look_up_256(v_nodes, bytes);
    const V16 along_u = hn::Add(look_up_256(u_nodes, bytes), product(both, v.level));
    const V16 along_v = hn::Add(by_v, product(both, u.level));
    const V16 plain =
        hn::Add(look_up_256(even_nodes, bytes), hn::Add(product(by_v, v.level), product(u.level, along_u)));
    const V16 first = product(both, product(u.slope, v.slope));
    const V16 second = product(both, hn::ShiftLeft<4>(product(u.spread, v.spread)));
    const V16 level = hn::Add(plain, hn::Add(product(correlation, first), product(half_square, second)));
    const V16 doubled = hn::Add(level, level);
    const V16 tone = product(doubled, hn::Sub(all(16384), doubled));
    const V16 shown = hn::Add(level, product(tone_curve, tone));
    const V16 steep = hn::Add(all(8192), product(tone_curve, hn::Sub(all(8192), doubled)));
    const V16 predicted = hn::Add(darks.at(dy16), product(contrasts.at(dy16), shown));
    V16 residual = hn::Sub(hn::ShiftLeft<4>(grey), predicted);
    seen = hn::AndNot(hn::VecFromMask(d16, hn::Gt(hn::Abs(residual), most)), seen);
    residual = hn::And(residual, seen);
    pixels = hn::Add(pixels, seen);

    const V16 slope_u = hn::And(product(product(along_u, u.slope), steep), seen);
    const V16 slope_v = hn::And(product(product(along_v, v.slope), steep), seen);
    const V16 is_flat = hn::VecFromMask(d16, hn::Eq(hn::Or(slope_u, slope_v), zero));
    const V16 on_edge = hn::AndNot(is_flat, seen), is_even = hn::And(is_flat, seen);
    on_edges = hn::Add(on_edges, on_edge);
    even = hn::Add(even, is_even);
    // A block's row is 128 bits, whose neighbours to the left are one entry below.
    const V16 even_residual = hn::And(residual, is_even);
    pairs = hn::Add(pairs, hn::And(is_even, hn::ShiftLeftLanes<1>(is_even)));
    even_squares = add_products(even_squares, even_residual, even_residual);
    pair_products = add_products(pair_products, even_residual, hn::ShiftLeftLanes<1>(even_residual));

    const V16 ones = hn::And(seen, one), levels = hn::And(product(shown, all(8192)), seen);
    if (hn::AllTrue(d16, hn::Eq(on_edge, zero))) {
      const std::size_t at = kLanes * stored.even_vectors++;
      hn::Store(ones, d16, stored.even[0] + at);
      hn::Store(levels, d16, stored.even[1] + at);
      hn::Store(residual, d16, stored.even[2] + at);
    } else {
      const std::size_t at = kLanes * stored.edge_vectors++;
      const auto put = [&](Channel channel, V16 value) HWY_ATTR { hn::Store(value, d16, stored.edges[channel] + at); };
      const auto steeper = [&](V16 value) HWY_ATTR { return hn::And(product(value, steep), on_edge); };
      put(kOne, ones);
      put(kLevel, levels);
      put(kTone, hn::And(product(tone, all(8192)), on_edge));
      put(kSlopeU, slope_u);
      put(kSlopeV, slope_v);
      put(kSpreadU, steeper(hn::ShiftLeft<2>(product(along_u, u.spread))));
      put(kSpreadV, steeper(hn::ShiftLeft<2>(product(along_v, v.spread))));
      put(kTwist, steeper(hn::Add(first, product(correlation, second))));
      put(kResidual, residual);
    }
    dy16 = hn::Add(dy16, all(next));
    dy32 = hn::Add(dy32, hn::Set(d32, next));
  }

  const auto count = [&](PlaceSums::Row row, V16 counts)
                         HWY_ATTR { add_to(sums.lanes[row], add_products(hn::Zero(d32), counts, all(-1))); };
  count(PlaceSums::kPixels, pixels);
  count(PlaceSums::kOnEdges, on_edges);
  count(PlaceSums::kSaturated, saturated);
  count(PlaceSums::kEven, even);
  count(PlaceSums::kPairs, pairs);
  add_to(sums.lanes[PlaceSums::kEvenSquares], even_squares);
  add_to(sums.lanes[PlaceSums::kPairProducts], pair_products);
  switch (stored.edge_vectors) {
    case 0:
      break;
    case 1:
      sum_edges<1>(stored, sums);
      break;
    case 2:
      sum_edges<2>(stored, sums);
      break;
    case 3:
      sum_edges<3>(stored, sums);
      break;
    case 4:
      sum_edges<4>(stored, sums);
      break;
    case 5:
      sum_edges<5>(stored, sums);
      break;
    case 6:
      sum_edges<6>(stored, sums);
      break;
    case 7:
      sum_edges<7>(stored, sums);
      break;
    default:
      sum_edges<8>(stored, sums);
      break;
  }
  if (stored.even_vectors > 0) sum_even(stored, sums);
}
#endif

}  // namespace berth::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth {
HWY_EXPORT(add_block);
void add_block(View2D<const u8> image, const EdgePieces& edge, const NodeBlock& block, PlaceSums& sums) {
  HWY_DYNAMIC_DISPATCH(add_block)(image, edge, block, sums);
}
}  // namespace berth
#endif
