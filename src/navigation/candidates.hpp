#pragma once

#include <vector>

#include "navigation/network_output.hpp"
#include "navigation/network_plan.hpp"

namespace berth {

/// A target's centre and diameter, px of the frame in 1/65536.
struct Place {
  std::int64_t x_q16 = 0;
  std::int64_t y_q16 = 0;
  std::int64_t d_q16 = 0;
};

/// A window's output in the frame: `window` has the corner and the step in 1/256 px, and the network saw it from pixel
/// (from_x, from_y) of the window on.
Place place_in_frame(const NetworkOutput& output, const s32* window, int from_x, int from_y);

struct Candidate {
  int score_q15 = 0;
  int position = 0;  // in the grid, row by row
  Place place;
};

/// Window pixels between two positions of a grid: the product of the strides before the fully connected layers.
int position_spacing(const Network& network);

/// The places of a search worth a closer look, best first: scores of `threshold_q15` or more, of equal ones the first
/// position; without those whose centre lies within half the diameter of a better one's. Returns how many; `candidates`
/// has room for every position.
std::size_t find_candidates(const Network& network, const NetworkPlan& search, const s32* window, int spacing,
                            const s32* sums, int threshold_q15, std::vector<Candidate>& candidates);

}  // namespace berth
