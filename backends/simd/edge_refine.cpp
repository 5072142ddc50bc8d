#include <algorithm>
#include <cstdlib>

#include "simd/simd_ops.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/edge_refine.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

#define FN HWY_INLINE
#define U32(x) static_cast<u32>(x)
#define S32(x) static_cast<s32>(x)
#include "fixed.h"
#undef FN
#undef U32
#undef S32

/// Where each station of a side saw the edge, in the order of the stations; those that saw none are left out.
struct Stations {
  static constexpr int kMost = 32;
  int count = 0;
  s32 along[kMost];
  s32 offset[kMost];
};

/// A side of a quadrilateral in the whole image (see quad_fit).
struct Side {
  Side(const s32* words, s32 scale)
      : upright((words[0] & 1) == 0),
        u_ref((words[0] >> 1) * scale),
        v_ref(words[1] * scale),
        slope(words[2]),
        from(words[3] * scale),
        to(words[4] * scale) {}
  s32 length() const { return std::abs(to - from); }
  s32 middle() const { return (from + to) / 2; }

  bool upright;
  s32 u_ref, v_ref, slope, from, to;
};

/// The pixels across a side at all its stations, from reach + 1 before the middle on: [2 * reach + 2][stations].
struct Strip {
  static constexpr int kStations = Stations::kMost;
  u8 pixels[6][kStations];
  s32 along[kStations];
  s32 distance[kStations];  // of the second pixel from the coarse line
  s32 place[kStations];     // of the first pixel, -1 where the strip leaves the image
};

// All stations at once: where they are, then their pixels (by scalars), then their edges. Quotients are had from
// doubles, exactly: both numbers have less than 31 bits, and so far from a whole number no quotient is rounded to it.
HWY_ATTR void look(const edge_refine_params& p, const u8* pixels, s32 contrast, const Side& side, Stations& seen) {
  const hn::CappedTag<s32, 8> ints;
  const hn::Rebind<u8, decltype(ints)> bytes;
  const int lanes = static_cast<int>(hn::Lanes(ints));
  const bool upright = side.upright;
  const s32 length = side.length();
  const s32 low = std::min(side.from, side.to);
  const s32 trim = side_trim(length);
  const s32 first = (low + trim) >> 1;
  const s32 lines = ((low + length - trim - 1) >> 1) - first + 1;
  const int count = std::min(lines, Strip::kStations);
  const int reach = length < 32 ? 1 : 2;
  const int across = 2 * reach + 2;
  const s32 stride = p.row_words * 4;
  const s32 next = upright ? 1 : stride;       // the next pixel across the side
  const s32 next_line = upright ? stride : 1;  // … and along it
  seen.count = 0;
  if (count <= 0) return;

  Strip strip;
  const auto v_ref = hn::Set(ints, side.v_ref);
  const auto slope = hn::Set(ints, side.slope);
  const auto last_middle = hn::Set(ints, (upright ? p.width : p.height) - reach);
  const auto line_end = hn::Set(ints, upright ? p.height : p.width);
  for (int k = 0; k < count; ++k) strip.along[k] = first + (lines <= Strip::kStations ? k : k * (lines - 1) / 31);
  for (int k = count; k % lanes != 0; ++k) strip.along[k] = strip.along[k - 1];
  for (int k = 0; k < count; k += lanes) {
    const auto line = hn::LoadU(ints, strip.along + k);
    const auto u = hn::Add(hn::Add(line, line), hn::Set(ints, 1));
    const auto v = hn::Add(v_ref, hn::ShiftRight<6>(hn::Mul(slope, hn::Sub(u, hn::Set(ints, side.u_ref)))));
    const auto middle = hn::ShiftRight<9>(hn::Add(v, hn::Set(ints, 256)));
    const auto begin = hn::Sub(middle, hn::Set(ints, reach));
    const auto in_image =
        hn::And(hn::And(hn::Gt(begin, hn::Zero(ints)), hn::Lt(middle, last_middle)), hn::Lt(line, line_end));
    const auto place = hn::Add(hn::Mul(line, hn::Set(ints, next_line)),
                               hn::Mul(hn::Sub(begin, hn::Set(ints, 1)), hn::Set(ints, next)));
    hn::StoreU(hn::IfThenElse(in_image, place, hn::Set(ints, -1)), ints, strip.place + k);
    hn::StoreU(hn::Sub(hn::ShiftLeft<9>(begin), v), ints, strip.distance + k);
    hn::StoreU(hn::Sub(u, hn::Set(ints, side.middle())), ints, strip.along + k);
  }
  for (int k = 0; k < count; ++k) {
    const u8* const pixel = pixels + std::max(strip.place[k], 0);
    for (int i = 0; i < across; ++i) strip.pixels[i][k] = pixel[i * next];
  }

  // The dark side lies on the right of the walk: edges that rise the other way count nothing.
  const auto sign = hn::Set(ints, upright == (side.to > side.from) ? 1 : -1);
  s32 weights[Strip::kStations];
  s32 moments[Strip::kStations];
  s32 gradients[Strip::kStations];
  for (int k = 0; k < count; k += lanes) {
    auto before = hn::PromoteTo(ints, hn::LoadU(bytes, strip.pixels[0] + k));
    auto distance = hn::LoadU(ints, strip.distance + k);
    auto weight = hn::Zero(ints);
    auto moment = hn::Zero(ints);
    auto sum = hn::Zero(ints);
    for (int i = 1; i < across; ++i, distance = hn::Add(distance, hn::Set(ints, 512))) {
      const auto here = hn::PromoteTo(ints, hn::LoadU(bytes, strip.pixels[i] + k));
      const auto gradient = hn::Max(hn::Mul(hn::Sub(here, before), sign), hn::Zero(ints));
      const auto square = hn::Mul(gradient, gradient);
      before = here;
      weight = hn::Add(weight, square);
      moment = hn::Add(moment, hn::Mul(square, distance));
      sum = hn::Add(sum, gradient);
    }
    hn::StoreU(weight, ints, weights + k);
    hn::StoreU(moment, ints, moments + k);
    hn::StoreU(sum, ints, gradients + k);
  }
  for (int k = 0; k < count; ++k) {
    if (strip.place[k] < 0 || gradients[k] == 0 || gradients[k] * 2 < contrast) continue;
    seen.along[seen.count] = strip.along[k];
    const s32 size = std::abs(moments[k]) + weights[k] / 2;
    const s32 offset = static_cast<s32>(static_cast<double>(size) / static_cast<double>(weights[k]));
    seen.offset[seen.count] = moments[k] < 0 ? -offset : offset;
    ++seen.count;
  }
}

/// The line through the stations, and again without the outliers (kernels/edge_refine.inl).
HWY_ATTR void refine(const Stations& seen, const Side& side, s32* edge) {
  const hn::CappedTag<s32, 8> ints;
  const int lanes = static_cast<int>(hn::Lanes(ints));
  const int halvings = side_halvings(side.length());
  s32 used = 0, residual = 0, slope = 0, mean_u = 0, value = 0;
  for (int pass = 0; pass < 2; ++pass) {
    auto counts = hn::Zero(ints), us = counts, vs = counts, uus = counts, uvs = counts, misses = counts;
    for (int i = 0; i < seen.count; i += lanes) {
      const auto u = hn::ShiftRightSame(hn::LoadU(ints, seen.along + i), halvings);
      const auto v = hn::LoadU(ints, seen.offset + i);
      auto miss = hn::Zero(ints);
      if (pass == 1) {
        const auto rise = hn::ShiftRight<8>(hn::Mul(hn::Set(ints, slope), hn::Sub(u, hn::Set(ints, mean_u))));
        miss = hn::Abs(hn::Sub(hn::Sub(v, hn::Set(ints, value)), rise));
      }
      const auto counted =
          hn::And(hn::FirstN(ints, static_cast<std::size_t>(seen.count - i)), hn::Lt(miss, hn::Set(ints, 193)));
      const auto used_u = hn::IfThenElseZero(counted, u);
      const auto used_v = hn::IfThenElseZero(counted, v);
      counts = hn::Add(counts, hn::IfThenElseZero(counted, hn::Set(ints, 1)));
      us = hn::Add(us, used_u);
      vs = hn::Add(vs, used_v);
      uus = hn::Add(uus, hn::Mul(used_u, used_u));
      uvs = hn::Add(uvs, hn::Mul(used_u, used_v));
      misses = hn::Add(misses, hn::IfThenElseZero(counted, miss));
    }
    const auto total = [&](auto sums) HWY_ATTR { return hn::GetLane(hn::SumOfLanes(ints, sums)); };
    const s32 n = total(counts);
    const s32 sum_u = total(us);
    const s32 sum_v = total(vs);
    const u32 sum_uu = static_cast<u32>(total(uus));
    const u32 sum_uv = static_cast<u32>(total(uvs));
    residual = total(misses);
    const s32 spread = n < 3 ? 0 : line_moment(n, sum_u, sum_u, sum_uu);
    used = spread > 0 ? n : 0;
    if (used == 0) continue;
    slope = ratio(line_moment(n, sum_u, sum_v, sum_uv), spread, 8, 64);
    mean_u = line_mean(n, sum_u);
    value = (line_value_q8(n, sum_u, sum_v, slope, 8) + 128) >> 8;
    residual /= n;
  }
  edge[0] = side.v_ref;
  edge[1] = side.slope;
  edge[2] = used;
  edge[3] = residual;
  if (used == 0) return;
  const s32 from_mean = ((side.u_ref - side.middle()) >> halvings) - mean_u;
  edge[0] += value + divide_rounded(slope * std::max(-2048, std::min(2048, from_mean)), 256);
  edge[1] += divide_rounded(slope, 4 * (1 << halvings));
}

void edge_refine(const edge_refine_params& p, const u32* pixels, const u32* levels, const s32* quads, s32* edges) {
  const u8* bytes = reinterpret_cast<const u8*>(pixels);
  Stations seen;
  for (int slot = 0; slot < p.max_contours; ++slot, quads += QUAD_WORDS, edges += EDGE_WORDS) {
    if ((quads[0] & QUAD_VALID) == 0) continue;
    for (int k = 0; k < 4; ++k) {
      const Side side(quads + QUAD_SIDE + k * QUAD_SIDE_WORDS, p.scale);
      look(p, bytes, static_cast<s32>(levels[3]), side, seen);
      refine(seen, side, edges + k * EDGE_SIDE_WORDS);
    }
  }
}

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth::simd_backend {
BERTH_SIMD_DISPATCH(edge_refine,
                    (const edge_refine_params& p, const u32* pixels, const u32* levels, const s32* quads, s32* edges),
                    (p, pixels, levels, quads, edges))
}  // namespace berth::simd_backend
#endif
