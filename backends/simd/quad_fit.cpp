#include <algorithm>
#include <cmath>
#include <vector>

#include "simd/simd_ops.hpp"
#include "simd/workspace.hpp"

#undef HWY_TARGET_INCLUDE
#define HWY_TARGET_INCLUDE "simd/quad_fit.cpp"
#include <hwy/foreach_target.h>
//
#include <hwy/highway.h>

HWY_BEFORE_NAMESPACE();
namespace berth::simd_backend::HWY_NAMESPACE {

namespace hn = hwy::HWY_NAMESPACE;

#define FN HWY_INLINE
#define U32(x) static_cast<u32>(x)
#define S32(x) static_cast<s32>(x)
// Lines are fitted with the kernels' own arithmetic; only how the points are searched differs.
#include "fixed.h"
#undef FN
#undef U32
#undef S32

/// A contour as it is searched.
struct Points {
  explicit Points(ContourPoints& room) : memory(room) {}

  ContourPoints& memory;
  const s32* x = nullptr;
  const s32* y = nullptr;
  const u32* words = nullptr;
  int count = 0;
  s32 area = 0;
  s32 x_min = 0, x_max = 0, y_min = 0, y_max = 0;

  /// Reads up to a vector past the last point, as the buffers of CPU backends allow.
  HWY_ATTR void load(const u32* point_words, int point_count) {
    memory.make_room(point_count);
    words = point_words;
    count = point_count;
    const std::size_t n = static_cast<std::size_t>(count);
    s32* const xs = memory.x.data();
    s32* const ys = memory.y.data();
    x = xs;
    y = ys;
    const hn::ScalableTag<s32> lanes;
    const std::size_t step = hn::Lanes(lanes);
    const auto one = hn::Set(lanes, 1);
    auto sum = hn::Zero(lanes);
    auto least_x = hn::Set(lanes, 1 << 30);
    auto least_y = least_x;
    auto most_x = hn::Zero(lanes);
    auto most_y = most_x;
    for (std::size_t i = 0; i < n; i += step) {
      const auto word = hn::LoadU(lanes, reinterpret_cast<const s32*>(words) + i);
      const auto px = hn::And(word, hn::Set(lanes, 0xffff));
      const auto py = hn::ShiftRight<16>(word);
      const auto centre = hn::Or(py, one);
      const auto is_end = hn::And(py, one);
      hn::StoreU(px, lanes, xs + i);
      hn::StoreU(centre, lanes, ys + i);
      if (i > 0) {  // the first vector comes when nothing reaches over it any more
        hn::StoreU(px, lanes, xs + n + i);
        hn::StoreU(centre, lanes, ys + n + i);
      }
      const auto valid = hn::FirstN(lanes, n - i);
      const auto half = hn::ShiftRight<1>(px);
      const auto sign = hn::Sub(is_end, one);  // 0 for ends, -1 for starts, whose crack counts negative
      sum = hn::Add(sum, hn::IfThenElseZero(valid, hn::Sub(hn::Xor(half, sign), sign)));
      least_x = hn::Min(least_x, hn::IfThenElse(valid, px, least_x));
      least_y = hn::Min(least_y, hn::IfThenElse(valid, centre, least_y));
      most_x = hn::Max(most_x, hn::IfThenElseZero(valid, px));
      most_y = hn::Max(most_y, hn::IfThenElseZero(valid, centre));
    }
    hn::StoreU(hn::LoadU(lanes, xs), lanes, xs + n);
    hn::StoreU(hn::LoadU(lanes, ys), lanes, ys + n);
    area = hn::GetLane(hn::SumOfLanes(lanes, sum));
    x_min = hn::GetLane(hn::MinOfLanes(lanes, least_x));
    y_min = hn::GetLane(hn::MinOfLanes(lanes, least_y));
    x_max = hn::GetLane(hn::MaxOfLanes(lanes, most_x));
    y_max = hn::GetLane(hn::MaxOfLanes(lanes, most_y));
  }

  /// The row boundary that the walk follows after a point.
  HWY_INLINE s32 boundary_after(int i) const {
    const u32 py = words[i < count ? i : i - count] >> 16;
    return static_cast<s32>(py + (py & 1u));
  }
};

/// The first point of [from, to) with the greatest value of `measure(x, y)` (vectors of s32 in, s32 out, >= 0).
struct Farthest {
  s32 value;
  int index;  // -1 where every value is 0
};
template <class Measure>
HWY_INLINE Farthest find_farthest(const Points& points, int from, int to, const Measure& measure) {
  const hn::ScalableTag<s32> lanes;
  const int step = static_cast<int>(hn::Lanes(lanes));
  auto best = hn::Zero(lanes);
  int i = from;
  for (; i + step <= to; i += step) {
    best = hn::Max(best, measure(hn::LoadU(lanes, &points.x[static_cast<std::size_t>(i)]),
                                 hn::LoadU(lanes, &points.y[static_cast<std::size_t>(i)])));
  }
  const auto rest = hn::FirstN(lanes, static_cast<std::size_t>(std::max(to - i, 0)));
  best = hn::Max(best, hn::IfThenElseZero(rest, measure(hn::LoadU(lanes, &points.x[static_cast<std::size_t>(i)]),
                                                        hn::LoadU(lanes, &points.y[static_cast<std::size_t>(i)]))));
  const s32 most = hn::GetLane(hn::MaxOfLanes(lanes, best));
  if (most == 0 || to <= from) return {0, -1};
  const auto wanted = hn::Set(lanes, most);
  for (i = from;; i += step) {  // it is there: the loop ends before `to`
    const auto hits = hn::Eq(measure(hn::LoadU(lanes, &points.x[static_cast<std::size_t>(i)]),
                                     hn::LoadU(lanes, &points.y[static_cast<std::size_t>(i)])),
                             wanted);
    const std::intptr_t first = hn::FindFirstTrue(lanes, hits);
    if (first >= 0) return {most, i + static_cast<int>(first)};
  }
}

HWY_INLINE Farthest farthest_from(const Points& points, int count, s32 x0, s32 y0) {
  const hn::ScalableTag<s32> lanes;
  const auto cx = hn::Set(lanes, x0);
  const auto cy = hn::Set(lanes, y0);
  return find_farthest(points, 0, count, [&](auto x, auto y) HWY_ATTR {
    const auto dx = hn::Sub(x, cx);
    const auto dy = hn::Sub(y, cy);
    return hn::Add(hn::Mul(dx, dx), hn::Mul(dy, dy));
  });
}

/// The point farthest from the chord of an arc.
HWY_INLINE Farthest farthest_from_chord(const Points& points, int from, int to) {
  const hn::ScalableTag<s32> lanes;
  const std::size_t a = static_cast<std::size_t>(from);
  const std::size_t b = static_cast<std::size_t>(to);
  const auto ax = hn::Set(lanes, points.x[a]);
  const auto ay = hn::Set(lanes, points.y[a]);
  const auto chord_x = hn::Set(lanes, points.x[b] - points.x[a]);
  const auto chord_y = hn::Set(lanes, points.y[b] - points.y[a]);
  return find_farthest(points, from + 1, to, [&](auto x, auto y) HWY_ATTR {
    return hn::Abs(hn::Sub(hn::Mul(chord_x, hn::Sub(y, ay)), hn::Mul(chord_y, hn::Sub(x, ax))));
  });
}

/// One contour on its way to a quadrilateral; the steps are those of kernels/quad_fit.inl.
class Quad {
 public:
  Quad(const Points& points, int count, bool hole, int min_side_px)
      : points_(points), count_(count), turn_(hole ? -1 : 1), min_side_px_(min_side_px) {}

  HWY_ATTR bool fit(s32* quad) {
    if (!find_vertices()) return false;
    if (!judge() && !(polish() && judge())) return false;
    s32 sums[4][5];
    for (int k = 0; k < 4; ++k) {
      if (!sum_side(k, sums[k])) return false;
    }
    quad[1] = count_;
    quad[2] = points_.area * turn_;
    quad[3] = shortest_;
    for (int k = 0; k < 4; ++k) write_side(k, sums[k], quad + QUAD_SIDE + k * QUAD_SIDE_WORDS);
    return true;
  }

 private:
  s32 x(int i) const { return points_.x[static_cast<std::size_t>(i)]; }
  s32 y(int i) const { return points_.y[static_cast<std::size_t>(i)]; }

  HWY_ATTR void measure(int k) {
    const Farthest far = farthest_from_chord(points_, vertex_[k], vertex_[k + 1]);
    const s32 dx = x(vertex_[k + 1]) - x(vertex_[k]);
    const s32 dy = y(vertex_[k + 1]) - y(vertex_[k]);
    far_[k] = far.index;
    // Exact: a double holds any such square, and the root of one less than a square is well below a whole number.
    length_[k] = static_cast<s32>(std::sqrt(static_cast<double>(static_cast<u32>(dx * dx + dy * dy))));
    const u32 cross = static_cast<u32>(far.value);
    const u32 length = static_cast<u32>(std::max(length_[k], 1));
    height_[k] = static_cast<s32>(cross / length * 16 + cross % length * 16 / length);
  }

  HWY_ATTR bool find_vertices() {
    const Farthest a =
        farthest_from(points_, count_, (points_.x_min + points_.x_max) / 2, (points_.y_min + points_.y_max) / 2);
    const int first = std::max(a.index, 0);
    const int other = std::max(farthest_from(points_, count_, x(first), y(first)).index, 0);
    if (first == other) return false;
    vertex_[0] = std::min(first, other);
    vertex_[1] = std::max(first, other);
    vertex_[2] = vertex_[0] + count_;
    measure(0);
    measure(1);
    for (int vertices = 2; vertices < 4; ++vertices) {
      int split = 0;
      for (int k = 1; k < vertices; ++k) {
        if (height_[k] > height_[split]) split = k;
      }
      if (far_[split] < 0) return false;
      for (int k = vertices; k > split; --k) vertex_[k + 1] = vertex_[k];
      for (int k = vertices - 1; k > split; --k) {
        far_[k + 1] = far_[k];
        height_[k + 1] = height_[k];
        length_[k + 1] = length_[k];
      }
      vertex_[split + 1] = far_[split];
      measure(split);
      measure(split + 1);
    }
    return true;
  }

  HWY_ATTR bool judge() {
    bool good = true;
    s32 polygon = 0;
    shortest_ = 1 << 30;
    for (int k = 0; k < 4; ++k) {
      const s32 ax = x(vertex_[k]) - x(vertex_[0]);
      const s32 ay = y(vertex_[k]) - y(vertex_[0]);
      const s32 bx = x(vertex_[k + 1]) - x(vertex_[0]);
      const s32 by = y(vertex_[k + 1]) - y(vertex_[0]);
      polygon += ax * by - bx * ay;
      shortest_ = std::min(shortest_, length_[k]);
      if (length_[k] < min_side_px_ * 2 || height_[k] > 51 + length_[k] * 4 / 5) good = false;
    }
    const s32 contour = points_.area * turn_ * 8;
    const s32 slack = contour / 10 * 3 + (points_.x_max - points_.x_min) * 8;
    return good && polygon * turn_ > 0 && std::abs(polygon * turn_ - contour) <= slack;
  }

  // Each vertex moves to where its neighbours' chord is farthest; what did not change since the last round is not
  // looked at again.
  HWY_ATTR bool polish() {
    int looked_from[4] = {-1, -1, -1, -1};
    int looked_to[4];
    for (int move = 0; move < 12; ++move) {
      const int k = move % 4;
      const int from = vertex_[(k + 3) % 4];
      int to = vertex_[(k + 1) % 4];
      if (to <= from) to += count_;
      if (looked_from[k] == from && looked_to[k] == to) continue;
      looked_from[k] = from;
      looked_to[k] = to;
      const int moved = farthest_from_chord(points_, from, to).index;
      if (moved >= 0) vertex_[k] = moved % count_;
    }
    std::rotate(vertex_, std::min_element(vertex_, vertex_ + 4), vertex_ + 4);
    vertex_[4] = vertex_[0] + count_;
    for (int k = 0; k < 4; ++k) {
      if (vertex_[k] >= vertex_[k + 1]) return false;
    }
    for (int k = 0; k < 4; ++k) measure(k);
    return true;
  }

  struct Side {
    bool upright;
    s32 u_from, u_to, u_middle, v_middle, length;
    int halvings;
  };
  HWY_ATTR Side side(int k) const {
    const int a = vertex_[k];
    const int b = vertex_[k + 1];
    Side s{};
    s.upright = std::abs(y(b) - y(a)) >= std::abs(x(b) - x(a));
    s.u_from = s.upright ? y(a) : x(a);
    s.u_to = s.upright ? y(b) : x(b);
    s.u_middle = (s.u_from + s.u_to) / 2;
    s.v_middle = s.upright ? (x(a) + x(b)) / 2 : (y(a) + y(b)) / 2;
    s.length = std::abs(s.u_to - s.u_from);
    s.halvings = side_halvings(s.length);
    return s;
  }

  /// n, sum u, sum v, sum u u, sum u v; false where no line goes through.
  HWY_ATTR bool sum_side(int k, s32* sums) const {
    const Side s = side(k);
    const s32 trim = side_trim(s.length);
    const s32 first = std::min(s.u_from, s.u_to) + trim;
    const s32 last = std::max(s.u_from, s.u_to) - trim;
    s32 n = 0, sum_u = 0, sum_v = 0;
    u32 sum_uu = 0, sum_uv = 0;
    const auto add = [&](s32 u, s32 v) {
      n += 1;
      sum_u += u;
      sum_v += v;
      sum_uu += static_cast<u32>(u * u);
      sum_uv += static_cast<u32>(u * v);
    };
    if (s.upright) {
      for (int i = vertex_[k]; i <= vertex_[k + 1]; ++i) {
        if (y(i) >= first && y(i) <= last) add((y(i) - s.u_middle) >> s.halvings, (x(i) - s.v_middle) >> s.halvings);
      }
    } else {
      const bool rightward = s.u_to > s.u_from;
      for (int i = vertex_[k]; i < vertex_[k + 1]; ++i) {
        if ((x(i + 1) > x(i)) != rightward) continue;
        const s32 v = (points_.boundary_after(i) - s.v_middle) >> s.halvings;
        const s32 end = std::min(std::max(x(i), x(i + 1)), last + 1);
        for (s32 u = std::max(std::min(x(i), x(i + 1)), first) | 1; u < end; u += 2)
          add((u - s.u_middle) >> s.halvings, v);
      }
    }
    sums[0] = n;
    sums[1] = sum_u;
    sums[2] = sum_v;
    sums[3] = static_cast<s32>(sum_uu);
    sums[4] = static_cast<s32>(sum_uv);
    return n >= 3 && line_moment(n, sum_u, sum_u, sum_uu) > 0;
  }

  HWY_ATTR void write_side(int k, const s32* sums, s32* words) const {
    const Side s = side(k);
    const s32 slope = ratio(line_moment(sums[0], sums[1], sums[2], static_cast<u32>(sums[4])),
                            line_moment(sums[0], sums[1], sums[1], static_cast<u32>(sums[3])), 14, 2);
    words[0] = (s.upright ? 0 : 1) + 2 * (s.u_middle + line_mean(sums[0], sums[1]) * (1 << s.halvings));
    words[1] = s.v_middle * 256 + line_value_q8(sums[0], sums[1], sums[2], slope, 14) * (1 << s.halvings);
    words[2] = slope;
    words[3] = s.u_from;
    words[4] = s.u_to;
  }

  const Points& points_;
  int count_;
  int turn_;
  int min_side_px_;
  int vertex_[5] = {};
  int far_[4] = {};
  s32 height_[4] = {};
  s32 length_[4] = {};
  s32 shortest_ = 0;
};

void quad_fit(Workspace& workspace, const quad_fit_params& p, const u32* contours, const u32* points, s32* quads) {
  Points loaded(workspace.points);
  // What contour_measure lets through has no more points: nothing is taken while frames fly.
  workspace.points.make_room(p.max_height * 5 / 2 + 4);
  const u32* record = contours + CONTOUR_HEADER;
  const int filled = static_cast<int>(std::min(contours[1], static_cast<u32>(p.max_contours)));
  for (int slot = 0; slot < filled; ++slot, record += CONTOUR_WORDS, quads += QUAD_WORDS) {
    const int count = static_cast<int>(record[1] & ~CONTOUR_HOLE);
    const bool hole = (record[1] & CONTOUR_HOLE) != 0;
    quads[0] = 0;
    if (count < 8) continue;
    loaded.load(points + record[3], count);
    if (loaded.x_min < p.margin * 2 || loaded.y_min < p.margin * 2 || loaded.x_max > (p.max_width - p.margin) * 2 ||
        loaded.y_max > (p.max_height - p.margin) * 2) {
      continue;
    }
    if (Quad(loaded, count, hole, p.min_side_px).fit(quads)) quads[0] = hole ? QUAD_VALID | QUAD_HOLE : QUAD_VALID;
  }
  for (int slot = filled; slot < p.max_contours; ++slot, quads += QUAD_WORDS) quads[0] = 0;
}

}  // namespace berth::simd_backend::HWY_NAMESPACE
HWY_AFTER_NAMESPACE();

#if HWY_ONCE
namespace berth::simd_backend {
BERTH_SIMD_DISPATCH(quad_fit,
                    (Workspace & workspace, const quad_fit_params& p, const u32* contours, const u32* points,
                     s32* quads),
                    (workspace, p, contours, points, quads))
}  // namespace berth::simd_backend
#endif
