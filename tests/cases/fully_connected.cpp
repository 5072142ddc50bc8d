#include "support/network_case.hpp"
#include "support/op_case.hpp"

namespace berth::cases {
namespace {

int positions_of(const fully_connected_params& p) { return p.count * p.grid_height * p.grid_width; }

OpCase connected(const std::string& name, const fully_connected_params& p, const std::vector<u32>& tensor,
                 const std::vector<u32>& weights, const std::vector<u32>& channels) {
  const int words = p.out_channels / 4;
  const int groups = (words + FULLY_CONNECTED_WORDS - 1) / FULLY_CONNECTED_WORDS *
                     ((positions_of(p) + FULLY_CONNECTED_POSITIONS - 1) / FULLY_CONNECTED_POSITIONS);
  return make_case(
      name, p,
      {tensor, weights, channels, unwritten(positions_of(p) * (p.shift < 0 ? p.out_channels : p.out_channels / 4))},
      groups * kGroupSize);
}

int in_words(const fully_connected_params& p) { return p.count * p.height * p.width * p.words; }
int weight_words(const fully_connected_params& p) { return p.out_channels * p.rows * p.columns * p.words; }

OpCase random_case(const std::string& name, const fully_connected_params& p, int bias = 20000) {
  const u64 seed = name.size() * 137 + static_cast<u64>(weight_words(p));
  return connected(name, p, random_activations(in_words(p), seed), random_weights(weight_words(p), seed + 1),
                   random_channels(p.out_channels, bias, seed + 2));
}

OpCase constant_case(const std::string& name, const fully_connected_params& p, int input, int weight, s32 bias) {
  return connected(name, p, constant_s8(in_words(p), input), constant_s8(weight_words(p), weight),
                   constant_channels(p.out_channels, bias, 32767));
}

}  // namespace

// One position and grids of them, one tensor and several, requantised and raw, more and fewer channels than a group
// makes; sums at their bounds.
std::vector<OpCase> fully_connected_cases() {
  std::vector<OpCase> cases;
  cases.push_back(random_case("one_word", {1, 1, 1, 1, 1, 1, 1, 1, 4, 0}));
  cases.push_back(random_case("after_pooling", {1, 7, 7, 4, 7, 7, 1, 1, 64, 6}));
  cases.push_back(random_case("vector", {1, 1, 1, 64, 1, 1, 1, 1, 32, 5}));
  cases.push_back(random_case("heads", {1, 1, 1, 16, 1, 1, 1, 1, 8, -1}));
  cases.push_back(random_case("heads_of_many", {9, 1, 1, 16, 1, 1, 1, 1, 4, -1}));
  cases.push_back(random_case("tensors", {5, 3, 5, 3, 3, 5, 1, 1, 20, 4}));
  cases.push_back(random_case("grid", {1, 9, 12, 2, 7, 7, 3, 6, 12, 5}));
  cases.push_back(random_case("grid_of_tensors", {3, 4, 5, 7, 2, 3, 3, 3, 36, 4}));
  cases.push_back(random_case("grid_1x1", {2, 5, 4, 8, 1, 1, 5, 4, 16, -1}));
  cases.push_back(random_case("grid_smaller", {2, 6, 7, 3, 3, 3, 2, 4, 8, -1}));
  cases.push_back(random_case("long_rows", {2, 2, 40, 8, 2, 40, 1, 1, 4, 6}));
  cases.push_back(random_case("grid_of_long_rows", {1, 6, 9, 11, 4, 5, 3, 5, 12, 5}));
  const fully_connected_params of_signed{2, 3, 9, 10, 3, 4, 1, 6, 8, 5};
  cases.push_back(connected("signed_input", of_signed, random_s8(in_words(of_signed), -128, 127, 3),
                            random_weights(weight_words(of_signed), 4), random_channels(8, 5000, 5)));
  const fully_connected_params p{2, 3, 4, 5, 3, 4, 1, 1, 8, 9};
  cases.push_back(constant_case("greatest", p, 127, 127, 0));
  cases.push_back(constant_case("least", p, 127, -127, 0));
  const s32 most = 2147483647 - 3 * 4 * 5 * 4 * 128 * 127;
  for (const int shift : {-1, 0, 16, 31}) {
    fully_connected_params shifted = p;
    shifted.shift = shift;
    const s32 bias = most - (shift > 0 ? static_cast<s32>(1u << (shift - 1)) : 0);
    cases.push_back(constant_case("bound_greatest_" + std::to_string(shift), shifted, -128, -127, bias));
    cases.push_back(constant_case("bound_least_" + std::to_string(shift), shifted, -128, 127, -bias));
  }
  return cases;
}

}  // namespace berth::cases
