// Four blocks' maps and models, a vector or two of them at a time.
#include <cmath>

#include "target/block_group.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "target/block_group_simd.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace berth::HWY_NAMESPACE {
namespace {

namespace hn = hwy::HWY_NAMESPACE;

using D = hn::CappedTag<double, BlockGroup::kMost>;
using Ints = hn::Rebind<std::int32_t, D>;
using V = hn::Vec<D>;
using VInt = hn::Vec<Ints>;
using Mask = hn::Mask<D>;

// Coordinates are quadratic in a block up to here, modules a pixel².
constexpr double kMostBend = 0.25;
// What NodeBlock's 16 bits have room for, grey levels.
constexpr double kMostDark = 1000, kMostContrast = 510, kMostToneStep = 7.8;

HWY_INLINE V all(double value) { return hn::Set(D(), value); }
// a b + c d
HWY_INLINE V two(V a, V b, V c, V d) { return hn::Add(hn::Mul(a, b), hn::Mul(c, d)); }

// To the nearest; below 2^29 in size. Demoting rounds towards zero, so it is given what is positive.
HWY_INLINE VInt rounded(V value) {
  constexpr int kAbove = 1 << 29;
  return hn::Sub(hn::DemoteTo(Ints(), hn::Add(value, all(kAbove + 0.5))), hn::Set(Ints(), kAbove));
}
HWY_INLINE VInt q16(V modules) { return rounded(hn::Mul(modules, all(1 << 16))); }
HWY_INLINE VInt q9(V level) { return rounded(hn::Mul(level, all(512))); }

HWY_INLINE unsigned bits(Mask mask) {
  std::uint8_t bytes[8] = {};
  hn::StoreMaskBits(D(), mask, bytes);
  return bytes[0];
}

// Always with values: a constructor that the compiler makes has not the vectors' instruction set.
struct Coefficients {
  V c, x, y, xx, xy, yy;
};

HWY_INLINE Coefficients load(const LensBlocks::Rays::Coordinate& from, std::size_t i) {
  const auto at = [&](std::size_t k) HWY_ATTR { return hn::Load(D(), from[k].data() + i); };
  return {at(0), at(1), at(2), at(3), at(4), at(5)};
}

HWY_INLINE Coefficients linear(const std::array<double, 3>& h, const Coefficients& x, const Coefficients& y) {
  const V a = all(h[0]), b = all(h[1]);
  return {hn::Add(two(a, x.c, b, y.c), all(h[2])),
          two(a, x.x, b, y.x),
          two(a, x.y, b, y.y),
          two(a, x.xx, b, y.xx),
          two(a, x.xy, b, y.xy),
          two(a, x.yy, b, y.yy)};
}

// A quotient's series, order by order: the product with the depth has the numerator's. `scale`: 1 / depth.c.
HWY_INLINE Coefficients quotient(const Coefficients& n, const Coefficients& depth, V scale) {
  const V c = hn::Mul(n.c, scale);
  const V x = hn::Mul(hn::Sub(n.x, hn::Mul(c, depth.x)), scale);
  const V y = hn::Mul(hn::Sub(n.y, hn::Mul(c, depth.y)), scale);
  const V xx = hn::Mul(hn::Sub(hn::Sub(n.xx, hn::Mul(c, depth.xx)), hn::Mul(x, depth.x)), scale);
  const V mixed = hn::Sub(hn::Sub(n.xy, hn::Mul(c, depth.xy)), hn::Mul(x, depth.y));
  const V xy = hn::Mul(hn::Sub(mixed, hn::Mul(y, depth.x)), scale);
  const V yy = hn::Mul(hn::Sub(hn::Sub(n.yy, hn::Mul(c, depth.yy)), hn::Mul(y, depth.y)), scale);
  return {c, x, y, xx, xy, yy};
}

struct Verdict {
  Mask outside, bent, fits;
};

// Stores a coordinate, and what of it does not depend on the blur.
HWY_INLINE Verdict put(const Coefficients& q, const GroupSource& source, std::size_t i, BlockGroup::Coordinate& to) {
  constexpr double kRounding = 1e-3;
  const D d;
  const Ints ints;
  const V coefficients[6] = {q.c, q.x, q.y, q.xx, q.xy, q.yy};
  for (std::size_t k = 0; k < 6; ++k) hn::Store(coefficients[k], d, to.q[k].data() + i);
  const V steep = hn::Add(hn::Abs(q.x), hn::Abs(q.y));
  const V bend = hn::Add(hn::Add(hn::Abs(q.xx), hn::Abs(q.xy)), hn::Abs(q.yy));
  const V wide = hn::Mul(all(4.5), steep);
  const Mask outside =
      hn::Or(hn::Lt(hn::Add(q.c, wide), all(source.first)), hn::Gt(hn::Sub(q.c, wide), all(source.last)));

  const V reach = hn::Add(two(all(4), steep, all(16), bend), all(kRounding));
  const V low = hn::Sub(q.c, reach), high = hn::Add(q.c, reach);
  hn::Store(low, d, to.low.data() + i);
  hn::Store(high, d, to.high.data() + i);
  // From half a module before a node to half a module after it, that node is the nearest.
  const auto node = [&](V at)
                        HWY_ATTR { return hn::Sub(hn::DemoteTo(ints, hn::Add(at, all(64.5))), hn::Set(ints, 64)); };
  const VInt first = node(low);
  const V nodes = hn::PromoteTo(d, hn::Sub(node(high), first));
  hn::Store(first, ints, to.first.data() + i);
  hn::Store(q16(hn::Add(hn::Sub(q.c, hn::PromoteTo(d, first)), all(0.5))), ints, to.start.data() + i);
  for (std::size_t k = 0; k < 5; ++k) hn::Store(q16(coefficients[k + 1]), ints, to.slopes[k].data() + i);
  const Mask near = hn::And(hn::Gt(low, all(-64)), hn::Lt(high, all(64)));
  // Not "not less", so that what is no number is bent.
  return {outside, hn::Not(hn::Lt(bend, all(kMostBend))), hn::And(near, hn::Lt(nodes, all(4)))};
}

// Stores grey levels; whether they fit.
HWY_INLINE Mask put_levels(const GroupSource& source, V px, V py, std::size_t i, BlockGroup& to) {
  const Ints ints;
  const V per_side = all(source.per_side);
  const V x = hn::Mul(hn::Sub(px, all(source.middle[0])), per_side);
  const V y = hn::Mul(hn::Sub(py, all(source.middle[1])), per_side);
  const auto& d = source.dark;
  const auto& c = source.contrast;
  const V dark = hn::Add(hn::Add(all(d[0]), hn::Mul(all(d[1]), x)), hn::Mul(all(d[2]), y));
  V light = hn::Add(hn::Add(all(c[0]), hn::Mul(all(c[1]), x)), hn::Mul(all(c[2]), y));
  light = hn::Add(light, hn::Mul(hn::Mul(all(c[3]), x), x));
  light = hn::Add(light, hn::Mul(hn::Mul(all(c[4]), x), y));
  light = hn::Add(light, hn::Mul(hn::Mul(all(c[5]), y), y));
  const V along_x = hn::Add(hn::Add(all(c[1]), hn::Mul(all(2 * c[3]), x)), hn::Mul(all(c[4]), y));
  const V along_y = hn::Add(hn::Add(all(c[2]), hn::Mul(all(c[4]), x)), hn::Mul(all(2 * c[5]), y));
  const V light_x = hn::Mul(along_x, per_side), light_y = hn::Mul(along_y, per_side);
  hn::Store(q9(dark), ints, to.dark.data() + i);
  hn::Store(q9(light), ints, to.contrast.data() + i);
  hn::Store(q9(light_x), ints, to.contrast_x.data() + i);
  hn::Store(q9(light_y), ints, to.contrast_y.data() + i);
  const V step_x = hn::Abs(light_x), step_y = hn::Abs(light_y);
  const V most = hn::Add(hn::Abs(light), hn::Mul(all(4), hn::Add(step_x, step_y)));
  const Mask level = hn::And(hn::Lt(hn::Abs(dark), all(kMostDark)), hn::Lt(most, all(kMostContrast)));
  return hn::And(level, hn::And(hn::Lt(step_x, all(kMostToneStep)), hn::Lt(step_y, all(kMostToneStep))));
}

}  // namespace

void fill_lanes(const LensBlocks::Rays& rays, const GroupSource& source, BlockGroup& group) {
  group.outside = group.bent = group.fits = 0;
  for (std::size_t i = 0; i < BlockGroup::kMost; i += hn::Lanes(D())) {
    const Coefficients x = load(rays.x, i), y = load(rays.y, i);
    const Coefficients depth = linear(source.back[2], x, y);
    const V scale = hn::Div(all(1), depth.c);
    const Verdict u = put(quotient(linear(source.back[0], x, y), depth, scale), source, i, group.u);
    const Verdict v = put(quotient(linear(source.back[1], x, y), depth, scale), source, i, group.v);
    const Mask levels =
        put_levels(source, hn::Load(D(), rays.px.data() + i), hn::Load(D(), rays.py.data() + i), i, group);
    group.outside |= bits(hn::Or(u.outside, v.outside)) << i;
    group.bent |= bits(hn::Or(u.bent, v.bent)) << i;
    group.fits |= bits(hn::And(levels, hn::And(u.fits, v.fits))) << i;
  }
  const auto fits = [&](double level) { return std::fabs(level * source.per_side) < kMostToneStep; };
  if (!fits(source.dark[1]) || !fits(source.dark[2])) group.fits = 0;
}

}  // namespace berth::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth {
HWY_EXPORT(fill_lanes);
void fill_group(const LensBlocks& lens, const GroupSource& source, BlockGroup& group) {
  LensBlocks::Rays rays;
  for (std::size_t k = 0; k < BlockGroup::kMost; ++k) {
    // Lanes that are not needed are the first's.
    const std::size_t from = k < group.count ? k : 0;
    lens.rays(group.columns[from], group.rows[from], k, rays);
  }
  HWY_DYNAMIC_DISPATCH(fill_lanes)(rays, source, group);
}
}  // namespace berth
#endif
