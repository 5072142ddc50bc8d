#include "support/network_case.hpp"
#include "support/op_case.hpp"

namespace berth::cases {
namespace {

OpCase normalized(const std::string& name, int words, const std::vector<u32>& statistics) {
  const int count = static_cast<int>(statistics.size()) / 2;
  std::vector<u8> all;
  for (int level = 0; level < 256; ++level) all.push_back(static_cast<u8>(level));
  const std::size_t size = static_cast<std::size_t>(count * words);
  return make_case(name, normalize_window_params{count, words},
                   {random_bytes(size, all, size), statistics, unwritten(count * words)}, count * words);
}

}  // namespace

// Means and gains at their bounds, where every pixel is held; gains that round; sizes past a group's end.
std::vector<OpCase> normalize_window_cases() {
  return {
      normalized("one_word", 1, {128, 256}),
      normalized("usual", 1000, {117, 301, 90, 777}),
      normalized("least_gain", 300, {0, 128, 255, 128, 128, 128}),
      normalized("greatest_gain", 300, {0, 2048, 255, 2048, 127, 2048}),
      normalized("many", 33, {1, 129, 2, 255, 3, 257, 4, 1023, 250, 2047, 251, 130, 252, 384, 253, 511, 254, 640}),
  };
}

}  // namespace berth::cases
