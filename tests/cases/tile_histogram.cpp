#include "support/frame_set.hpp"
#include "support/op_case.hpp"
#include "support/pictures.hpp"

namespace berth::cases {

// All tiles in one bin, steps that leave words out, more groups than words.
std::vector<OpCase> tile_histogram_cases() {
  std::vector<OpCase> cases = frame_cases(Op::tile_histogram);
  const tile_histogram_params params[] = {{1, 1, 1}, {1000, 1, 3}, {4000, 7, 2}, {129, 128, 8}};
  for (const tile_histogram_params& p : params) {
    const std::size_t words = static_cast<std::size_t>(p.words);
    std::vector<u32> minima = random_bytes(words, {0, 1, 2, 100}, 23);
    std::vector<u32> maxima = random_bytes(words, {100, 254, 255}, 24);
    cases.push_back(make_case("words_" + std::to_string(p.words), p,
                              {minima, maxima, std::vector<u32>(static_cast<std::size_t>(p.groups) * 768, 9)},
                              p.groups * kGroupSize));
  }
  cases.push_back(
      make_case("one_bin", tile_histogram_params{512, 1, 2},
                {std::vector<u32>(512, 0x40404040), std::vector<u32>(512, 0x41414141), std::vector<u32>(1536, 9)},
                2 * kGroupSize));
  return cases;
}

}  // namespace berth::cases
