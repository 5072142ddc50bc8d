#include "support/network_case.hpp"
#include "support/op_case.hpp"
#include "support/pictures.hpp"

namespace berth::cases {
namespace {

struct Window {
  s32 x, y, step;
};

/// An image of that size in padding of other values, and windows of out_words × out_height.
OpCase windows_of(const std::string& name, int width, int height, int out_words, int out_height,
                  const std::vector<Window>& windows, const std::vector<u8>& levels) {
  const int count = static_cast<int>(windows.size());
  const extract_window_params p{width, height, (width + 31) / 32 * 8, count, out_words, out_height};
  std::vector<u32> corners;
  for (const Window& window : windows) {
    for (const s32 value : {window.x, window.y, window.step, s32{77}}) corners.push_back(static_cast<u32>(value));
  }
  const std::size_t pixel_words =
      static_cast<std::size_t>((height + 3) / 4 * 4) * static_cast<std::size_t>(p.row_words);
  const int items = count * out_height * out_words;
  return make_case(name, p, {random_bytes(pixel_words, levels, pixel_words), corners, unwritten(items)}, items);
}

}  // namespace

// Whole pixels and fractions of them, every scale's ends and scales past them; windows half and wholly outside.
std::vector<OpCase> extract_window_cases() {
  std::vector<u8> all;
  for (int level = 0; level < 256; ++level) all.push_back(static_cast<u8>(level));
  const std::vector<u8> ends = {0, 255};
  std::vector<OpCase> cases;
  for (const s32 step : {256, 257, 384, 640, 1024, 2559, 2560}) {
    cases.push_back(windows_of("step_" + std::to_string(step), 97, 61, 5, 9,
                               {{0, 0, step}, {256, 512, step}, {4097, 1035, step}, {-300, 255, step}}, all));
  }
  cases.push_back(windows_of("step_held", 40, 40, 2, 8,
                             {{128, 64, 0}, {1, 2, 255}, {3, 4, -5}, {0, 0, 2561}, {0, 0, 1 << 30}}, all));
  cases.push_back(windows_of("outside", 33, 19, 3, 6,
                             {{-1000 * 256, 0, 300},
                              {1000 * 256 + 7, 99, 300},
                              {5, -(1 << 26), 700},
                              {9, 1 << 26, 256},
                              {-(1 << 28), -(1 << 28), 2560},
                              {1 << 28, 1 << 28, 2560},
                              {30 * 256 + 1, 16 * 256 + 255, 333}},
                             all));
  cases.push_back(windows_of("black_and_white", 64, 48, 8, 32, {{-77, -33, 511}, {100, 200, 256}, {7, 9, 2560}}, ends));
  cases.push_back(windows_of("white", 31, 7, 2, 8, {{-900, -900, 2560}, {300, 200, 2311}, {1, 1, 257}}, {255}));
  cases.push_back(windows_of("one_pixel", 1, 1, 1, 1, {{0, 0, 256}, {-128, 100, 700}}, all));
  pictures::Random random(71);
  std::vector<Window> many;
  for (int i = 0; i < 40; ++i) {
    many.push_back({random.below(60000) - 20000, random.below(40000) - 15000, 256 + random.below(2305)});
  }
  cases.push_back(windows_of("many", 131, 77, 3, 7, many, all));
  return cases;
}

}  // namespace berth::cases
