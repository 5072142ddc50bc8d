#include "target/pattern_sums.hpp"

#include <algorithm>

namespace berth {
namespace {

constexpr int kModule = 1 << 18;
constexpr int kNone = 1 << 20;

// Where a pixel lies in a block's channels: quarter by quarter.
constexpr int slot(int column, int row) { return 32 * (row / 4) + 16 * (column / 4) + 4 * (row % 4) + column % 4; }

struct Place {
  int u, v;  // q18
};

// |coefficient of a linear term| · 4 + … stays below 2^31 while a block is less than 512 modules wide.
Place place_of(const BlockModel& m, int dx, int dy) {
  const auto at = [&](const std::array<int, 6>& q) {
    return (q[0] + q[1] * dx + q[2] * dy + q[3] * (dx * dx) + q[4] * (dx * dy) + q[5] * (dy * dy)) >> 4;
  };
  return {at(m.u), at(m.v)};
}

// The edge at `distance` (q18 modules) before the pixel. |distance| is cut at `reach`, so the product stays below
// 4 · 2^26.
const EdgePoint& edge_at(const EdgeProfile& profile, int distance, int reach, int per_module) {
  constexpr int kShift = 18 + 8 - EdgeProfile::kPerDeviation_bits;
  constexpr int kMost = EdgeProfile::kReach << EdgeProfile::kPerDeviation_bits;
  const int cut = std::min(reach, std::max(-reach, distance));
  const int t = (cut * per_module + (1 << (kShift - 1))) >> kShift;
  return profile.at(std::min(kMost, std::max(-kMost, t)));
}

struct Seen {
  int level, slope_u, slope_v, spread_u, spread_v, twist;  // q12
};

// Three modules in a row under the blur, q14.
struct Rise {
  int level, slope, spread;
};

// The two edges of a pixel's module along one axis.
struct Edges {
  // `at`: place in the module, q18.
  Edges(const EdgeProfile& profile, int at, int reach, int per_module)
      : before(edge_at(profile, at, reach, per_module)), after(edge_at(profile, at - kModule, reach, per_module)) {}
  static bool far(int at, int reach) { return at >= reach && kModule - at >= reach; }
  Rise across(int first, int middle, int last) const {
    return {first * 16384 + middle * before.level + last * after.level, middle * before.slope + last * after.slope,
            middle * before.spread + last * after.spread};
  }

  const EdgePoint& before;
  const EdgePoint& after;
};

int q12(int value_q14) { return (value_q14 + 2) >> 2; }
int q11(int value_q12) { return (value_q12 + 1) >> 1; }
int product_q12(int value_q28) { return (value_q28 + (1 << 15)) >> 16; }

// The pattern near a corner of a module: each row of three is a profile along u, profiles along v blend the rows.
// Products are q28 in 32 bits: |level| <= 2^14, |slope| and |spread| < 2^13.
Seen look_at_corner(const PatternCell& cell, const Edges& along_u, const Edges& along_v, const BlockModel& m) {
  Rise rows[3];
  for (std::size_t j = 0; j < 3; ++j) rows[j] = along_u.across(cell.left[j], cell.middle[j], cell.right[j]);
  const EdgePoint& above = along_v.before;
  const EdgePoint& below = along_v.after;
  const auto blend = [&](int Rise::*part) {
    return product_q12(rows[0].*part * 16384 + above.level * (rows[1].*part - rows[0].*part) +
                       below.level * (rows[2].*part - rows[1].*part));
  };
  const auto change = [&](int at_above, int at_below, int Rise::*part) {
    return product_q12(at_above * (rows[1].*part - rows[0].*part) + at_below * (rows[2].*part - rows[1].*part));
  };
  // A correlated normal distribution of two variables, to the second power of the correlation.
  const int first = change(above.slope, below.slope, &Rise::slope);
  const int second = change(above.spread, below.spread, &Rise::spread);
  Seen seen;
  seen.level = blend(&Rise::level) + ((m.correlation * first + m.half_square * second + 2048) >> 12);
  seen.slope_u = blend(&Rise::slope);
  seen.slope_v = change(above.slope, below.slope, &Rise::level);
  seen.spread_u = blend(&Rise::spread);
  seen.spread_v = change(above.spread, below.spread, &Rise::level);
  seen.twist = first + ((m.correlation * second + 2048) >> 12);
  return seen;
}

// The pattern about a pixel at (fu, fv) of its module, q18. Where edges are out of reach, they are left out.
Seen look(const PatternCell& cell, const EdgeProfile& profile, const BlockModel& m, int fu, int fv) {
  const bool far_u = Edges::far(fu, m.reach_u), far_v = Edges::far(fv, m.reach_v);
  const int left{cell.left[1]}, here = left + cell.middle[1];
  Seen seen{};
  if (far_u && far_v) {
    seen.level = here * 4096;
  } else if (far_v) {
    const Rise rise = Edges(profile, fu, m.reach_u, m.per_module_u).across(left, cell.middle[1], cell.right[1]);
    seen.level = q12(rise.level);
    seen.slope_u = q12(rise.slope);
    seen.spread_u = q12(rise.spread);
  } else if (far_u) {
    const int above = cell.left[0] + cell.middle[0], below = cell.left[2] + cell.middle[2];
    const Rise rise = Edges(profile, fv, m.reach_v, m.per_module_v).across(above, here - above, below - here);
    seen.level = q12(rise.level);
    seen.slope_v = q12(rise.slope);
    seen.spread_v = q12(rise.spread);
  } else {
    return look_at_corner(cell, Edges(profile, fu, m.reach_u, m.per_module_u),
                          Edges(profile, fv, m.reach_v, m.per_module_v), m);
  }
  return seen;
}

}  // namespace

void fill_channels(View2D<const u8> image, const PatternCells& cells, const EdgeProfile& profile, const BlockModel& m,
                   int row_step, BlockChannels& channels) {
  for (auto& channel : channels.values) channel.fill(0);
  PixelCounts& counts = channels.counts;
  counts = {};
  for (int dy = -4; dy < 4; dy += row_step) {
    if (m.y + dy >= image.height) break;
    const u8* const row = image.row(m.y + dy);
    int before = kNone;
    for (int dx = -4; dx < 4; ++dx) {
      const int left_residual = before;
      before = kNone;
      if (m.x + dx >= image.width) break;
      const Place at = place_of(m, dx, dy);
      if (at.u < m.u_first || at.u >= m.u_last || at.v < m.v_first || at.v >= m.v_last) continue;
      const PatternCell& cell = cells.at(at.u >> 18, at.v >> 18);
      if (cell.kind == PatternCell::kUnknown) continue;
      const int grey = row[m.x + dx];
      if (grey == 0 || grey == 255) {
        ++counts.saturated;
        continue;
      }
      Seen seen{};
      if (cell.kind == PatternCell::kEven) {
        seen.level = cell.left[0] * 4096;
      } else {
        seen = look(cell, profile, m, at.u & (kModule - 1), at.v & (kModule - 1));
      }
      const int tone = (seen.level * (4096 - seen.level) + 2048) >> 12;
      const int shown = seen.level + ((m.tone * tone + 2048) >> 12);
      const int dark = (m.dark[0] + m.dark[1] * dx + m.dark[2] * dy) >> 8;
      const int contrast = (m.contrast[0] + m.contrast[1] * dx + m.contrast[2] * dy) >> 8;
      const int residual = (grey * 32 - dark - ((contrast * shown + 2048) >> 12) + 1) >> 1;
      if (residual > m.most_residual || residual < -m.most_residual) continue;
      ++counts.pixels;
      const bool on_edge = (seen.slope_u | seen.slope_v) != 0;
      counts.on_edges += on_edge ? 1 : 0;
      const std::size_t i = static_cast<std::size_t>(slot(dx + 4, dy + 4));
      const auto put = [&](Channel channel, int value) {
        channels.values[channel][i] = static_cast<std::int16_t>(value);
      };
      put(kOne, 1);
      put(kLevel, q11(shown));
      put(kResidual, residual);
      if (!on_edge) {
        before = residual;
        ++counts.even;
        counts.even_squares += residual * residual;
        if (left_residual != kNone) {
          ++counts.pairs;
          counts.pair_products += left_residual * residual;
        }
        continue;
      }
      put(kTone, q11(tone));
      // The tone curve's own steepness here.
      const int steep = 4096 + ((m.tone * (4096 - 2 * seen.level) + 2048) >> 12);
      const auto steeper = [&](int value) { return (value * steep + 4096) >> 13; };
      put(kSlopeU, steeper(seen.slope_u));
      put(kSlopeV, steeper(seen.slope_v));
      put(kSpreadU, steeper(seen.spread_u));
      put(kSpreadV, steeper(seen.spread_v));
      put(kTwist, steeper(seen.twist));
    }
  }
}

void add_products(const BlockChannels& channels, int first, int count, PlaceSums& sums) {
  std::size_t product = 0;
  for (std::size_t a = 0; a < kChannels; ++a) {
    for (std::size_t b = a; b < kChannels; ++b, ++product) {
      const std::int16_t* const p = channels.values[a].data() + first;
      const std::int16_t* const q = channels.values[b].data() + first;
      std::int32_t sum = 0;
      for (int i = 0; i < count; ++i) sum += static_cast<std::int32_t>(p[i]) * q[i];
      sums.rows[product] += sum;
    }
  }
}

void PlaceSums::add(const PixelCounts& c) {
  const std::int32_t values[] = {c.pixels, c.on_edges, c.saturated, c.even, c.pairs, c.even_squares, c.pair_products};
  for (std::size_t k = 0; k < kRows - kPixels; ++k) rows[kPixels + k] += values[k];
}

PixelCounts PlaceSums::counts() const {
  return {rows[kPixels], rows[kOnEdges],     rows[kSaturated],   rows[kEven],
          rows[kPairs],  rows[kEvenSquares], rows[kPairProducts]};
}

}  // namespace berth
