#include <algorithm>
#include <cstdlib>
#include <vector>

#include "reference/arithmetic.hpp"
#include "reference/layout.hpp"
#include "reference/reference.hpp"

namespace berth::reference {
namespace {

/// A side's coarse line, as quad_fit wrote it, in the whole image.
struct Line {
  Line(const s32* words, int scale)
      : upright(words[0] % 2 == 0),
        u_ref(words[0] / 2 * scale),
        v_ref(words[1] * scale),
        slope(words[2]),
        from(words[3] * scale),
        to(words[4] * scale) {}
  int length() const { return std::abs(to - from); }
  std::int64_t v_at(int u) const {
    return v_ref + LineFit::floor_shift(static_cast<std::int64_t>(slope) * (u - u_ref), 6);
  }

  bool upright;
  int u_ref, v_ref, slope, from, to;
};

struct Station {
  int u;          // about the side's middle, half pixels
  int offset_q9;  // of the edge from the coarse line, px
};

class Refiner {
 public:
  Refiner(const edge_refine_params& p, const u32* pixels, int contrast) : p_(p), pixels_(pixels), contrast_(contrast) {}

  void refine(const Line& line, s32* edge) const {
    const std::vector<Station> stations = look(line);
    const int halvings = side_halvings(line.length());
    int slope = 0, value = 0;
    std::int64_t mean_u = 0, residual = 0;
    int used = 0;
    for (int pass = 0; pass < 2; ++pass) {
      LineFit fit;
      residual = 0;
      for (const Station& station : stations) {
        const std::int64_t u = LineFit::floor_shift(station.u, halvings);
        const std::int64_t miss =
            pass == 0 ? 0 : station.offset_q9 - value - LineFit::floor_shift(slope * (u - mean_u), 8);
        if (std::abs(miss) > 192) continue;
        fit.add(u, station.offset_q9);
        residual += std::abs(miss);
      }
      used = fit.points() >= 3 && fit.spread() > 0 ? fit.points() : 0;
      if (used == 0) continue;
      slope = fit.slope(8, 64);
      mean_u = fit.mean_u();
      value = static_cast<int>(LineFit::floor_shift(fit.value_q8(slope, 8) + 128, 8));
      residual /= used;
    }
    edge[0] = line.v_ref;
    edge[1] = line.slope;
    edge[2] = used;
    edge[3] = static_cast<s32>(residual);
    if (used == 0) return;
    const std::int64_t from_mean = LineFit::floor_shift(line.u_ref - (line.from + line.to) / 2, halvings) - mean_u;
    const std::int64_t reach = std::max<std::int64_t>(-2048, std::min<std::int64_t>(2048, from_mean));
    edge[0] += value + static_cast<s32>(divide_rounded(slope * reach, 256));
    edge[1] += static_cast<s32>(divide_rounded(slope, std::int64_t{4} << halvings));
  }

 private:
  /// Pixel `i` across the side in its row (upright) or column `along`.
  int pixel(const Line& line, int i, int along) const {
    return line.upright ? byte_at(pixels_, p_.row_words * 4, i, along) : byte_at(pixels_, p_.row_words * 4, along, i);
  }

  std::vector<Station> look(const Line& line) const {
    const int length = line.length();
    const int low = std::min(line.from, line.to) + side_trim(length);
    const int high = std::max(line.from, line.to) - side_trim(length);
    // Rows (columns) whose centre 2 y + 1 lies in [low, high].
    const int first = low / 2;
    const int count = (high + 1) / 2 - first;
    std::vector<Station> stations;
    for (int k = 0; k < std::min(count, 32); ++k) {
      const int along = first + (count <= 32 ? k : k * (count - 1) / 31);
      Station station{};
      if (find_edge(line, along, station)) stations.push_back(station);
    }
    return stations;
  }

  bool find_edge(const Line& line, int along, Station& station) const {
    const int length = line.length();
    const int reach = length < 32 ? 1 : 2;
    const std::int64_t v = line.v_at(2 * along + 1);
    const int middle = static_cast<int>(LineFit::floor_shift(v + 256, 9));
    if (along >= (line.upright ? p_.height : p_.width)) return false;
    if (middle - reach < 1 || middle + reach >= (line.upright ? p_.width : p_.height)) return false;
    // The dark side is on the right of the walk: at smaller x going down, at smaller y going left.
    const bool dark_at_smaller = line.upright ? line.to > line.from : line.to < line.from;
    std::int64_t weights = 0, moments = 0, gradients = 0;
    for (int i = middle - reach; i <= middle + reach; ++i) {
      const int rise = pixel(line, i, along) - pixel(line, i - 1, along);
      const std::int64_t gradient = std::max(dark_at_smaller ? rise : -rise, 0);
      weights += gradient * gradient;
      moments += gradient * gradient * (i * 512 - v);
      gradients += gradient;
    }
    if (gradients == 0 || gradients * 2 < contrast_) return false;
    station = {2 * along + 1 - (line.from + line.to) / 2, static_cast<int>(divide_rounded(moments, weights))};
    return true;
  }

  const edge_refine_params& p_;
  const u32* pixels_;
  int contrast_;
};

}  // namespace

void edge_refine(const edge_refine_params& p, const u32* pixels, const u32* levels, const s32* quads, s32* edges) {
  const Refiner refiner(p, pixels, static_cast<int>(levels[3]));
  for (int slot = 0; slot < p.max_contours; ++slot) {
    const s32* quad = quads + slot * QUAD_WORDS;
    if ((quad[0] & QUAD_VALID) == 0) continue;
    for (int k = 0; k < 4; ++k) {
      refiner.refine(Line(quad + QUAD_SIDE + k * QUAD_SIDE_WORDS, p.scale),
                     edges + slot * EDGE_WORDS + k * EDGE_SIDE_WORDS);
    }
  }
}

}  // namespace berth::reference
