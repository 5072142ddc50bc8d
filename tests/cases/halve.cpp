#include "support/frame_set.hpp"
#include "support/op_case.hpp"
#include "support/pictures.hpp"

namespace berth::cases {

// Sums at the rounding points and at the bytes' ends; halves that are wider than the source's half.
std::vector<OpCase> halve_cases() {
  std::vector<OpCase> cases = frame_cases(Op::halve);
  for (const int row_words : {8, 24, 40}) {
    for (const int rows : {4, 12}) {
      const int half_row_words = (row_words / 2 + 7) / 8 * 8;
      const int half_rows = (rows / 2 + 3) / 4 * 4;
      const std::size_t words = static_cast<std::size_t>(row_words * rows);
      const std::size_t half_words = static_cast<std::size_t>(half_row_words * half_rows);
      cases.push_back(make_case(
          "row_words_" + std::to_string(row_words) + "_rows_" + std::to_string(rows),
          halve_params{row_words, rows, half_row_words, half_rows},
          {random_bytes(words, {0, 1, 2, 3, 127, 128, 253, 254, 255}, words), std::vector<u32>(half_words, 11)},
          half_row_words * half_rows));
    }
  }
  return cases;
}

}  // namespace berth::cases
