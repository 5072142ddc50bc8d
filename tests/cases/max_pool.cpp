#include "support/network_case.hpp"
#include "support/op_case.hpp"

namespace berth::cases {
namespace {

OpCase pooled(const std::string& name, int count, int height, int width, int words, int kernel, int stride, int low,
              int high) {
  const max_pool_params p{count,  height, width, words, (height - kernel) / stride + 1, (width - kernel) / stride + 1,
                          kernel, stride};
  const int out_words = count * p.out_height * p.out_width * words;
  return make_case(
      name, p,
      {random_s8(count * height * width * words, low, high, static_cast<u64>(out_words)), unwritten(out_words)},
      out_words);
}

}  // namespace

// Overlapping and apart, rows and columns left over at the end, bytes of either sign.
std::vector<OpCase> max_pool_cases() {
  return {
      pooled("one_pixel", 1, 1, 1, 1, 1, 1, 0, 127),
      pooled("3x3_stride_2", 1, 15, 15, 8, 3, 2, 0, 127),
      pooled("3x3_stride_2_rest", 2, 16, 14, 3, 3, 2, 0, 127),
      pooled("2x2", 3, 9, 7, 2, 2, 2, 0, 127),
      pooled("stride_past_the_kernel", 1, 17, 23, 3, 2, 5, 0, 127),
      pooled("whole_tensor", 2, 6, 6, 5, 6, 1, 0, 127),
      pooled("signed", 1, 12, 12, 4, 3, 1, -128, 127),
      pooled("negative", 1, 8, 8, 1, 2, 1, -128, -120),
      pooled("words_27", 1, 9, 7, 27, 3, 2, -128, 127),
      pooled("zero", 1, 8, 9, 2, 3, 3, 0, 0),
      pooled("nearly_equal", 2, 10, 10, 6, 3, 2, 126, 127),
  };
}

}  // namespace berth::cases
