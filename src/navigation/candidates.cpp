#include "navigation/candidates.hpp"

#include <algorithm>

namespace berth {

Place place_in_frame(const NetworkOutput& output, const s32* window, int from_x, int from_y) {
  // The middle of window pixel u lies at corner + (u + 1/2) step - 1/2 frame pixels.
  const std::int64_t step = window[2];
  const auto in_frame = [step](std::int64_t at_q16, s32 corner) {
    return static_cast<std::int64_t>(corner) * 256 + ((at_q16 + 32768) * step >> 8) - 32768;
  };
  return {in_frame(output.x_q16 + (static_cast<std::int64_t>(from_x) << 16), window[0]),
          in_frame(output.y_q16 + (static_cast<std::int64_t>(from_y) << 16), window[1]),
          static_cast<std::int64_t>(output.d_q16) * step >> 8};
}

int position_spacing(const Network& network) {
  int spacing = 1;
  for (const Layer& layer : network.layers) {
    if (const auto* convolve = std::get_if<ConvolveLayer>(&layer)) spacing *= convolve->stride_y;
    if (const auto* pool = std::get_if<MaxPoolLayer>(&layer)) spacing *= pool->stride;
  }
  return spacing;
}

std::size_t find_candidates(const Network& network, const NetworkPlan& search, const s32* window, int spacing,
                            const s32* sums, int threshold_q15, std::vector<Candidate>& candidates) {
  std::size_t count = 0;
  const int positions = search.grid_width() * search.grid_height();
  for (int position = 0; position < positions; ++position) {
    const NetworkOutput output =
        network_output(network, sums + static_cast<std::ptrdiff_t>(position) * search.sums_each());
    if (output.score_q15 < threshold_q15) continue;
    candidates[count++] = {output.score_q15, position,
                           place_in_frame(output, window, position % search.grid_width() * spacing,
                                          position / search.grid_width() * spacing)};
  }
  std::sort(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(count),
            [](const Candidate& a, const Candidate& b) {
              return a.score_q15 != b.score_q15 ? a.score_q15 > b.score_q15 : a.position < b.position;
            });
  std::size_t kept = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const Place& place = candidates[i].place;
    const auto covers = [&place](const Candidate& better) {
      const std::int64_t half = better.place.d_q16 / 2;
      const std::int64_t dx = (place.x_q16 - better.place.x_q16) >> 8;  // squares stay within 64 bits
      const std::int64_t dy = (place.y_q16 - better.place.y_q16) >> 8;
      return dx * dx + dy * dy < (half >> 8) * (half >> 8);
    };
    if (std::none_of(candidates.begin(), candidates.begin() + static_cast<std::ptrdiff_t>(kept), covers)) {
      candidates[kept++] = candidates[i];
    }
  }
  return kept;
}

}  // namespace berth
