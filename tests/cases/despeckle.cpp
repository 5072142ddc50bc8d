#include "support/frame_set.hpp"
#include "support/op_case.hpp"
#include "support/pictures.hpp"

namespace berth::cases {

// Sparse and dense bits; neighbours across word borders.
std::vector<OpCase> despeckle_cases() {
  std::vector<OpCase> cases = frame_cases(Op::despeckle);
  for (const int row_words : {1, 3, 20}) {
    const int height = 13;
    const std::size_t words = static_cast<std::size_t>(row_words) * static_cast<std::size_t>(height);
    std::vector<u32> bits = random_bytes(words, {0, 0, 1, 2, 16, 128}, static_cast<u64>(row_words));
    cases.push_back(make_case("sparse_" + std::to_string(row_words), despeckle_params{height, row_words},
                              {bits, std::vector<u32>(words, 3)}, static_cast<int>(words)));
    for (std::size_t i = 0; i < words; ++i) bits[i] = i % 2 == 0 ? 0x80000000u : 1u;
    cases.push_back(make_case("word_borders_" + std::to_string(row_words), despeckle_params{height, row_words},
                              {bits, std::vector<u32>(words, 3)}, static_cast<int>(words)));
  }
  return cases;
}

}  // namespace berth::cases
