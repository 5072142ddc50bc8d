#include "support/network_case.hpp"
#include "support/op_case.hpp"

namespace berth::cases {
namespace {

OpCase statistics_of(const std::string& name, const window_statistics_params& p, const std::vector<u32>& pixels) {
  return make_case(name, p, {pixels, unwritten(p.count * 2)}, p.count * kGroupSize);
}

}  // namespace

// No contrast, the greatest there is, gains at and between their bounds, the most pixels there may be.
std::vector<OpCase> window_statistics_cases() {
  std::vector<OpCase> cases;
  for (const u8 level : {u8{0}, u8{1}, u8{128}, u8{255}}) {
    cases.push_back(statistics_of("constant_" + std::to_string(level), {1, 300, 1}, random_bytes(300, {level}, 1)));
  }
  cases.push_back(statistics_of("black_and_white", {2, 1024, 1}, random_bytes(2048, {0, 255}, 2)));
  cases.push_back(statistics_of("nearly_constant", {3, 500, 1}, random_bytes(1500, {99, 100}, 3)));
  cases.push_back(statistics_of("few_levels", {9, 64, 1}, random_bytes(576, {90, 96, 104, 110}, 4)));
  std::vector<u8> all;
  for (int level = 0; level < 256; ++level) all.push_back(static_cast<u8>(level));
  cases.push_back(statistics_of("full_range", {3, 16384, 1}, random_bytes(3 * 16384, all, 5)));
  cases.push_back(statistics_of("most_pixels_white", {1, 16512, 1}, random_bytes(16512, {255}, 6)));
  cases.push_back(statistics_of("stride", {2, 16384, 4}, random_bytes(2 * 16384, all, 7)));
  cases.push_back(statistics_of("odd_stride", {4, 1001, 7}, random_bytes(4 * 1001, {3, 5, 200, 255}, 8)));
  cases.push_back(statistics_of("stride_past_the_end", {2, 5, 9}, random_bytes(10, all, 9)));
  cases.push_back(statistics_of("one_word", {1, 1, 1}, random_bytes(1, all, 10)));
  cases.push_back(statistics_of("two_wide", {20, 129, 1}, random_bytes(20 * 129, {0, 10, 20, 60}, 11)));
  return cases;
}

}  // namespace berth::cases
