#include "frame/quads.hpp"

#include <algorithm>
#include <array>
#include <utility>

#include "berth/ops.hpp"

namespace berth {
namespace {

/// a x + b y = c in pixels whose centres are at integers.
struct Line {
  double a, b, c;
};

// Words are half pixels from the image's corner: u in halves, v in 1/512 px, slope q14.
Line to_line(bool upright, double u_ref, double v_ref, double slope_q14) {
  const double u = u_ref / 2 - 0.5;
  const double v = v_ref / 512 - 0.5;
  const double slope = slope_q14 / 16384;
  // v' = v + slope (u' - u); upright sides have x as v.
  return upright ? Line{1, -slope, v - slope * u} : Line{-slope, 1, v - slope * u};
}

bool intersect(const Line& p, const Line& q, std::array<double, 2>& point) {
  const double determinant = p.a * q.b - q.a * p.b;
  if (determinant < 1e-3 && determinant > -1e-3) return false;
  point = {(p.c * q.b - q.c * p.b) / determinant, (p.a * q.c - q.a * p.c) / determinant};
  return true;
}

bool corners_of(const std::array<Line, 4>& lines, std::array<std::array<double, 2>, 4>& corners) {
  for (std::size_t k = 0; k < 4; ++k) {
    if (!intersect(lines[(k + 3) % 4], lines[k], corners[k])) return false;
  }
  return true;
}

// A refined side counts when this many stations saw an edge.
constexpr int kMinStations = 4;

}  // namespace

bool to_candidate(const s32* quad, const s32* edge, int scale, int x, int y, QuadCandidate& candidate) {
  candidate.reversed_border = (quad[0] & QUAD_HOLE) != 0;
  candidate.has_fine = true;
  std::array<Line, 4> coarse{};
  std::array<Line, 4> fine{};
  for (std::size_t k = 0; k < 4; ++k) {
    const s32* side = quad + QUAD_SIDE + k * QUAD_SIDE_WORDS;
    const s32* refined = edge + k * EDGE_SIDE_WORDS;
    const bool upright = side[0] % 2 == 0;
    // The frame's own numbers, added while they are integers: then nothing after depends on where a window lies.
    const int u_ref = (side[0] >> 1) * scale + 2 * (upright ? y : x);
    const int v = 512 * (upright ? x : y);
    coarse[k] = to_line(upright, u_ref, side[1] * scale + v, side[2]);
    fine[k] = to_line(upright, u_ref, refined[0] + v, refined[1]);
    // Residuals are rounded down to whole 1/512 px.
    candidate.sides[k] = {refined[2], (refined[3] + 0.5) / 512};
    if (refined[2] < kMinStations) candidate.has_fine = false;
  }
  if (!corners_of(coarse, candidate.coarse)) return false;
  if (!candidate.has_fine || !corners_of(fine, candidate.fine)) {
    candidate.has_fine = false;
    candidate.fine = candidate.coarse;
  }
  if (candidate.reversed_border) {  // a hole is walked counter-clockwise
    std::swap(candidate.coarse[1], candidate.coarse[3]);
    std::swap(candidate.fine[1], candidate.fine[3]);
    std::reverse(candidate.sides.begin(), candidate.sides.end());
  }
  return true;
}

bool is_cut_off(const QuadCandidate& candidate, int width, int height) {
  constexpr double kMargin = 2;  // px
  for (std::size_t k = 0; k < 4; ++k) {
    const auto& a = candidate.coarse[k];
    const auto& b = candidate.coarse[(k + 1) % 4];
    const double x = (a[0] + b[0]) / 2;
    const double y = (a[1] + b[1]) / 2;
    if (x < kMargin || y < kMargin || x > width - 1 - kMargin || y > height - 1 - kMargin) return true;
  }
  return false;
}

}  // namespace berth
