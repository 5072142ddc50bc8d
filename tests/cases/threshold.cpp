#include "support/frame_set.hpp"
#include "support/op_case.hpp"
#include "support/pictures.hpp"

namespace berth::cases {

// Pixels at the cut and one beside it, contrasts at the limit and one beside it, on both sides of the byte's sign.
std::vector<OpCase> threshold_cases() {
  std::vector<OpCase> cases = frame_cases(Op::threshold);
  for (const int width : {1, 31, 32, 33, 100}) {
    for (const u32 contrast : {0u, 1u, 5u, 128u, 255u}) {
      const int height = 3 + width % 7;
      const int row_words = (width + 31) / 32;
      const int tile_rows = (height + 3) / 4;
      const std::size_t tiles = static_cast<std::size_t>(row_words * 2) * static_cast<std::size_t>(tile_rows);
      const std::vector<u32> pixels =
          random_bytes(tiles * 16, {0, 5, 120, 122, 123, 127, 128, 130, 250, 255}, contrast);
      std::vector<u32> minima(tiles);
      std::vector<u32> maxima(tiles);
      const std::unique_ptr<Backend> reference = open_backend("reference");
      const OpCase extrema = make_case("", tile_extrema_params{row_words * 2, tile_rows}, {pixels, minima, maxima},
                                       static_cast<int>(tiles));
      const std::vector<std::vector<u32>> made = run_case(extrema, *reference);
      minima.assign(made[1].begin(), made[1].begin() + static_cast<std::ptrdiff_t>(tiles));
      maxima.assign(made[2].begin(), made[2].begin() + static_cast<std::ptrdiff_t>(tiles));
      for (const int cut : {0, 80, 128, 255}) {
        cases.push_back(make_case(
            "width_" + std::to_string(width) + "_contrast_" + std::to_string(contrast) + "_cut_" + std::to_string(cut),
            threshold_params{width, height, row_words, tile_rows, cut},
            {pixels,
             minima,
             maxima,
             {0, 0, 0, contrast},
             std::vector<u32>(static_cast<std::size_t>(height * row_words), 5)},
            tile_rows * row_words));
      }
    }
  }
  return cases;
}

}  // namespace berth::cases
