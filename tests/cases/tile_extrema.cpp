#include "support/frame_set.hpp"
#include "support/op_case.hpp"
#include "support/pictures.hpp"

namespace berth::cases {

// Bytes around the sign bit, where a wrong comparison of packed bytes shows.
std::vector<OpCase> tile_extrema_cases() {
  std::vector<OpCase> cases = frame_cases(Op::tile_extrema);
  for (const int row_words : {2, 6, 40}) {
    const int tile_rows = 7;
    const std::size_t tiles = static_cast<std::size_t>(row_words) * tile_rows;
    cases.push_back(make_case("row_words_" + std::to_string(row_words), tile_extrema_params{row_words, tile_rows},
                              {random_bytes(tiles * 16, {0, 1, 126, 127, 128, 129, 254, 255}, 22),
                               std::vector<u32>(tiles, 1), std::vector<u32>(tiles, 2)},
                              static_cast<int>(tiles)));
  }
  return cases;
}

}  // namespace berth::cases
