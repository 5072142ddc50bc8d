// The definition of a block's sums in 16 bits. A product keeps 15 bits fewer than it has, rounded: what vectors of
// every kind have an instruction for.
#include "target/node_block.hpp"

#include <algorithm>

namespace berth::reference {
namespace {

int product(int a, int b) { return (a * b + (1 << 14)) >> 15; }
int saturated(int value) { return std::min(32767, std::max(-32768, value)); }

// One edge, t deviations before the pixel.
struct Edge {
  // `behind`: pixel behind the edge, modules q16.
  Edge(const EdgePieces& pieces, int behind, int gain, int doublings) {
    t = product(behind, gain);
    for (int k = 0; k < doublings; ++k) t = saturated(t + t);
    t = std::max(-32767, t);
    const int size = t < 0 ? -t : t;
    const std::size_t piece = static_cast<std::size_t>(size >> 12);
    const int f = (size & 4095) << 3;
    const int cubic = product(pieces[3][piece], f);
    const int square = cubic + pieces[2][piece];
    const int linear = product(square, f) + pieces[1][piece];
    const int value = product(linear, f) + pieces[0][piece];
    level = t < 0 ? -value : value;
    slope = (linear + product(square + cubic, f)) * 2;
    spread = product(t, slope);
  }
  int t;       // q13, cut at 4
  int level;   // -1 … 1, q15
  int slope;   // its derivative by t, q15
  int spread;  // t times that, q13
};

struct Seen {
  std::array<int, kChannels> values = {};
  bool counts = false, is_saturated = false, on_edge = false;
};

Seen look(const NodePlace& place, const NodeBlock& m, const EdgePieces& pieces, int grey, int dx, int dy) {
  Seen seen;
  const auto at = [&](const NodeCoordinate& q) {
    const auto& s = q.slopes;
    return q.start + s[0] * dx + s[1] * dy + s[2] * (dx * dx) + s[3] * (dx * dy) + s[4] * (dy * dy);
  };
  const int at_u = at(m.u), at_v = at(m.v);
  if (at_u < m.u_first || at_u >= m.u_last || at_v < m.v_first || at_v >= m.v_last) return seen;
  const std::size_t node = static_cast<std::size_t>((at_v >> 16) * 4 + (at_u >> 16));
  if (m.nodes.known[node] == 0) return seen;
  seen.is_saturated = grey == 0 || grey == 255;
  if (seen.is_saturated) return seen;

  const Edge u(pieces, (at_u & 65535) - 32768, place.gain_u, place.doublings_u);
  const Edge v(pieces, (at_v & 65535) - 32768, place.gain_v, place.doublings_v);
  // q13: what is between the edges changes along u by `along_u` for each unit of the edge's level, likewise along v.
  const int both = m.nodes.both[node] * 256;
  const int along_u = m.nodes.by_u[node] * 256 + product(both, v.level);
  const int along_v = m.nodes.by_v[node] * 256 + product(both, u.level);
  const int plain = m.nodes.even[node] * 256 + product(m.nodes.by_v[node] * 256, v.level) + product(u.level, along_u);
  // A correlated normal distribution of two variables, to the second power of the correlation.
  const int first = product(both, product(u.slope, v.slope));
  const int second = product(both, product(u.spread, v.spread) * 16);
  const int level = plain + product(place.correlation, first) + product(place.half_square, second);
  const int tone = product(2 * level, 16384 - 2 * level);
  const int shown = level + product(place.tone, tone);
  const int steep = 8192 + product(place.tone, 8192 - 2 * level);
  const int dark = (m.dark >> 5) + (((m.dark & 31) + 16 + m.dark_step[0] * dx + m.dark_step[1] * dy) >> 5);
  const int contrast =
      (m.contrast >> 3) + (((m.contrast & 7) + 4 + m.contrast_step[0] * dx + m.contrast_step[1] * dy) >> 3);
  const int residual = grey * 16 - dark - product(contrast, shown);
  if (residual > place.most_residual || residual < -place.most_residual) return seen;

  seen.counts = true;
  seen.values[kOne] = 1;
  seen.values[kLevel] = product(shown, 8192);
  seen.values[kResidual] = residual;
  const int slope_u = product(product(along_u, u.slope), steep);
  const int slope_v = product(product(along_v, v.slope), steep);
  seen.on_edge = (slope_u | slope_v) != 0;
  if (!seen.on_edge) return seen;
  seen.values[kTone] = product(tone, 8192);
  seen.values[kSlopeU] = slope_u;
  seen.values[kSlopeV] = slope_v;
  seen.values[kSpreadU] = product(product(along_u, u.spread) * 4, steep);
  seen.values[kSpreadV] = product(product(along_v, v.spread) * 4, steep);
  seen.values[kTwist] = product(first + product(place.correlation, second), steep);
  return seen;
}

}  // namespace

void add_block(View2D<const u8> image, const EdgePieces& edge, const NodePlace& place, const NodeBlock& block,
               PlaceSums& sums) {
  PixelCounts counts;
  for (int dy = -4; dy < 4; dy += place.row_step) {
    const u8* const row = image.row(block.y + dy);
    bool left_is_even = false;
    int left_residual = 0;
    for (int dx = -4; dx < 4; ++dx) {
      const Seen seen = look(place, block, edge, row[block.x + dx], dx, dy);
      counts.saturated += seen.is_saturated ? 1 : 0;
      counts.pixels += seen.counts ? 1 : 0;
      counts.on_edges += seen.on_edge ? 1 : 0;
      std::size_t k = 0;
      for (std::size_t a = 0; a < kChannels; ++a) {
        for (std::size_t b = a; b < kChannels; ++b, ++k) sums.rows[k] += seen.values[a] * seen.values[b];
      }
      const bool is_even = seen.counts && !seen.on_edge;
      const int residual = seen.values[kResidual];
      if (is_even) {
        ++counts.even;
        counts.even_squares += residual * residual;
        if (left_is_even) {
          ++counts.pairs;
          counts.pair_products += left_residual * residual;
        }
      }
      left_is_even = is_even;
      left_residual = residual;
    }
  }
  sums.add(counts);
}

}  // namespace berth::reference
