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

#define FN HWY_INLINE
#define U32(x) static_cast<u32>(x)
#define S32(x) static_cast<s32>(x)
#include "fixed.h"
#undef FN
#undef U32
#undef S32

/// Where each station of a side saw the edge, in the order of the stations; those that saw none are left out.
struct Stations {
  int count = 0;
  s32 along[32];
  s32 offset[32];
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

HWY_ATTR void look(const edge_refine_params& p, const u8* pixels, s32 contrast, const Side& side, Stations& seen) {
  const bool upright = side.upright;
  const s32 length = side.length();
  const s32 low = std::min(side.from, side.to);
  const s32 trim = side_trim(length);
  const s32 first = (low + trim) >> 1;
  const s32 lines = ((low + length - trim - 1) >> 1) - first + 1;
  const int reach = length < 32 ? 1 : 2;
  const s32 across = upright ? p.width : p.height;
  const s32 most_lines = upright ? p.height : p.width;
  const s32 sign = upright == (side.to > side.from) ? 1 : -1;
  const std::ptrdiff_t stride = static_cast<std::ptrdiff_t>(p.row_words) * 4;
  const std::ptrdiff_t next = upright ? 1 : stride;       // the next pixel across the side
  const std::ptrdiff_t next_line = upright ? stride : 1;  // … and along it
  seen.count = 0;
  for (int station = 0; station < std::min(lines, 32); ++station) {
    const s32 line = first + (lines <= 32 ? station : station * (lines - 1) / 31);
    const s32 u = 2 * line + 1;
    const s32 v = side.v_ref + ((side.slope * (u - side.u_ref)) >> 6);
    const s32 middle = (v + 256) >> 9;
    if (middle - reach < 1 || middle + reach >= across || line >= most_lines) continue;
    const u8* pixel = pixels + line * next_line + (middle - reach - 1) * next;
    s32 before = *pixel;
    s32 weights = 0;
    s32 moments = 0;
    s32 gradients = 0;
    s32 distance = (middle - reach) * 512 - v;
    for (int i = 0; i <= 2 * reach; ++i, distance += 512) {
      pixel += next;
      const s32 here = *pixel;
      const s32 gradient = std::max((here - before) * sign, 0);
      before = here;
      weights += gradient * gradient;
      moments += gradient * gradient * distance;
      gradients += gradient;
    }
    if (gradients == 0 || gradients * 2 < contrast) continue;
    seen.along[seen.count] = u - side.middle();
    seen.offset[seen.count] = divide_rounded(moments, weights);
    ++seen.count;
  }
}

/// The line through the stations, and again without the outliers (kernels/edge_refine.inl).
HWY_ATTR void refine(const Stations& seen, const Side& side, s32* edge) {
  const int halvings = side_halvings(side.length());
  s32 used = 0, residual = 0, slope = 0, mean_u = 0, value = 0;
  for (int pass = 0; pass < 2; ++pass) {
    s32 n = 0, sum_u = 0, sum_v = 0;
    u32 sum_uu = 0, sum_uv = 0;
    residual = 0;
    for (int i = 0; i < seen.count; ++i) {
      const s32 u = seen.along[i] >> halvings;
      const s32 miss = pass == 0 ? 0 : seen.offset[i] - value - ((slope * (u - mean_u)) >> 8);
      if (std::abs(miss) > 192) continue;
      n += 1;
      sum_u += u;
      sum_v += seen.offset[i];
      sum_uu += static_cast<u32>(u * u);
      sum_uv += static_cast<u32>(u * seen.offset[i]);
      residual += std::abs(miss);
    }
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
