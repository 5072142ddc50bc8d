#include "support/frame_set.hpp"
#include "support/op_case.hpp"
#include "support/pictures.hpp"

namespace berth::cases {

namespace {

OpCase levels_of(const std::string& name, const normalize_params& p, const std::vector<u32>& histograms) {
  return make_case(name, p, {histograms, std::vector<u32>(4, 7)}, kGroupSize);
}

}  // namespace

// Empty histograms, quantiles that fall on a bin's edge, and each of the contrast's bounds deciding.
std::vector<OpCase> normalize_cases() {
  std::vector<OpCase> cases = frame_cases(Op::normalize);
  const normalize_params usual{1, 10, 990, 250, 40, 30, 5, 40};
  cases.push_back(levels_of("empty", usual, std::vector<u32>(768, 0)));
  std::vector<u32> edges(768, 0);
  edges[10] = 10;  // exactly 10 of 1000 below: the quantile is the next bin
  edges[20] = 990;
  edges[256 + 200] = 990;
  edges[256 + 250] = 10;
  edges[512 + 3] = 250;
  edges[512 + 90] = 750;
  cases.push_back(levels_of("at_the_edge", usual, edges));
  edges[10] = 11;
  edges[20] = 989;
  cases.push_back(levels_of("past_the_edge", usual, edges));
  normalize_params bounded = usual;
  bounded.max_contrast = 6;
  cases.push_back(levels_of("held_above", bounded, edges));
  bounded = usual;
  bounded.min_contrast = 39;
  cases.push_back(levels_of("held_below", bounded, edges));
  bounded = usual;
  bounded.groups = 3;
  std::vector<u32> three(3 * 768);
  pictures::Random random(25);
  for (u32& count : three) count = static_cast<u32>(random.below(5));
  cases.push_back(levels_of("three_groups", bounded, three));
  return cases;
}

}  // namespace berth::cases
