#include "support/frame_set.hpp"
#include "support/op_case.hpp"
#include "support/pictures.hpp"

namespace berth::cases {

// Rows that end black, full rows, and counts that end exactly at a group's border.
std::vector<OpCase> run_count_cases() {
  std::vector<OpCase> cases = frame_cases(Op::run_count);
  for (const int height : {1, 63, 64, 65}) {
    const int row_words = 2;
    const int words = height * row_words;
    const int groups = words / kGroupSize + 1;
    const std::vector<u32> offsets(static_cast<std::size_t>(groups * kGroupSize + groups + 1), 77);
    for (const int level : {0, 0x55, 0xff}) {
      cases.push_back(make_case("height_" + std::to_string(height) + "_level_" + std::to_string(level),
                                run_count_params{height, row_words, groups * kGroupSize},
                                {random_bytes(static_cast<std::size_t>(words), {static_cast<u8>(level)}, 1), offsets},
                                groups * kGroupSize));
    }
  }
  return cases;
}

}  // namespace berth::cases
