#include "support/network_case.hpp"
#include "support/op_case.hpp"

namespace berth::cases {
namespace {

struct Kernel {
  int height, width, stride_y, stride_x, pad_y, pad_x;
};

convolve_params layer(int count, int height, int width, int words, int out_words, const Kernel& k, int groups,
                      int shift) {
  return {count,
          height,
          width,
          words,
          (height + 2 * k.pad_y - k.height) / k.stride_y + 1,
          (width + 2 * k.pad_x - k.width) / k.stride_x + 1,
          out_words,
          k.height,
          k.width,
          k.stride_y,
          k.stride_x,
          k.pad_y,
          k.pad_x,
          words / groups,
          out_words / groups,
          shift};
}

int in_words(const convolve_params& p) { return p.count * p.height * p.width * p.words; }
int weight_words(const convolve_params& p) {
  return p.kernel_height * p.kernel_width * p.group_words * p.out_words * 4;
}

OpCase convolved(const std::string& name, const convolve_params& p, const std::vector<u32>& tensor,
                 const std::vector<u32>& weights, const std::vector<u32>& channels) {
  const int blocks = (p.out_width + CONVOLVE_PIXELS - 1) / CONVOLVE_PIXELS;
  return make_case(name, p, {tensor, weights, channels, unwritten(p.count * p.out_height * p.out_width * p.out_words)},
                   p.count * p.out_height * blocks * p.out_words);
}

OpCase random_case(const std::string& name, const convolve_params& p, int bias = 20000) {
  const u64 seed = name.size() * 131 + static_cast<u64>(in_words(p));
  return convolved(name, p, random_activations(in_words(p), seed), random_weights(weight_words(p), seed + 1),
                   random_channels(p.out_words * 4, bias, seed + 2));
}

/// One input and one weight everywhere.
OpCase constant_case(const std::string& name, const convolve_params& p, int input, int weight, s32 bias,
                     s32 multiplier) {
  return convolved(name, p, constant_s8(in_words(p), input), constant_s8(weight_words(p), weight),
                   constant_channels(p.out_words * 4, bias, multiplier));
}

void add_shapes(std::vector<OpCase>& cases) {
  // The two networks' kinds of layer, on small tensors.
  cases.push_back(random_case("first_layer", layer(2, 32, 24, 1, 8, {8, 2, 4, 1, 0, 0}, 1, 4)));
  cases.push_back(random_case("first_layer_wide", layer(1, 43, 37, 1, 3, {11, 3, 4, 1, 0, 0}, 1, 4)));
  cases.push_back(random_case("5x5_padded", layer(1, 13, 15, 4, 4, {5, 5, 1, 1, 2, 2}, 1, 5)));
  cases.push_back(random_case("5x5_groups", layer(2, 9, 11, 4, 6, {5, 5, 1, 1, 2, 2}, 2, 4)));
  cases.push_back(random_case("3x3_padded", layer(3, 7, 9, 6, 5, {3, 3, 1, 1, 1, 1}, 1, 4)));
  cases.push_back(random_case("3x3_groups", layer(1, 8, 8, 6, 4, {3, 3, 1, 1, 1, 1}, 2, 4)));
  // Odd ones.
  cases.push_back(random_case("one_pixel", layer(1, 1, 1, 1, 1, {1, 1, 1, 1, 0, 0}, 1, 0)));
  cases.push_back(random_case("one_pixel_padded", layer(2, 1, 1, 3, 2, {3, 3, 1, 1, 1, 1}, 1, 3)));
  cases.push_back(random_case("1x1", layer(1, 5, 17, 7, 9, {1, 1, 1, 1, 0, 0}, 1, 3)));
  cases.push_back(random_case("stride_past_the_kernel", layer(1, 19, 23, 2, 3, {2, 2, 3, 3, 0, 0}, 1, 3)));
  cases.push_back(random_case("strides_differ", layer(2, 17, 33, 2, 2, {3, 5, 2, 3, 1, 2}, 1, 4)));
  cases.push_back(random_case("stride_2_padded", layer(1, 16, 40, 3, 2, {5, 3, 2, 2, 2, 1}, 1, 4)));
  cases.push_back(random_case("kernel_as_large", layer(1, 6, 9, 3, 4, {6, 9, 1, 1, 0, 0}, 1, 5)));
  cases.push_back(random_case("mostly_padding", layer(1, 2, 3, 1, 2, {5, 7, 1, 1, 4, 6}, 1, 3)));
  for (const int width : {7, 15, 16, 17, 31, 33}) {
    cases.push_back(random_case("width_" + std::to_string(width), layer(1, 3, width, 2, 2, {3, 3, 1, 1, 1, 1}, 1, 4)));
  }
  // Channels by whole vectors of several sizes, rows that their tiles fill, leave a rest of or overlap in.
  for (const int width : {4, 8, 13, 14, 23}) {
    cases.push_back(
        random_case("channels_96_width_" + std::to_string(width), layer(1, 3, width, 2, 24, {3, 3, 1, 1, 1, 1}, 1, 4)));
  }
  cases.push_back(random_case("channels_48", layer(1, 3, 19, 2, 12, {3, 3, 1, 1, 1, 1}, 1, 4)));
  cases.push_back(random_case("channels_64_groups", layer(2, 4, 11, 4, 32, {5, 5, 1, 1, 2, 2}, 2, 4)));
  for (const int out_words : {4, 12, 16}) {
    const convolve_params wide = layer(2, 12, 29, 1, out_words, {8, 2, 4, 1, 2, 1}, 1, 4);
    cases.push_back(convolved("signed_channels_" + std::to_string(out_words * 4), wide,
                              random_s8(in_words(wide), -128, 127, 10), random_weights(weight_words(wide), 11),
                              random_channels(out_words * 4, 5000, 12)));
  }
  // More padding at the far ends than at the near ones, up to taps that are all outside.
  convolve_params beyond = layer(1, 5, 6, 2, 3, {3, 3, 1, 1, 0, 0}, 1, 4);
  beyond.out_height += 4;
  beyond.out_width += 12;
  cases.push_back(random_case("past_the_end", beyond));
  const convolve_params signed_input = layer(1, 12, 10, 2, 4, {4, 2, 4, 1, 0, 0}, 1, 4);
  cases.push_back(convolved("signed_input", signed_input, random_s8(in_words(signed_input), -128, 127, 5),
                            random_weights(weight_words(signed_input), 6), random_channels(16, 5000, 7)));
}

void add_extremes(std::vector<OpCase>& cases) {
  const convolve_params p = layer(1, 5, 9, 8, 2, {3, 3, 1, 1, 1, 1}, 1, 6);
  cases.push_back(constant_case("greatest", p, 127, 127, 0, 32767));
  cases.push_back(constant_case("least", p, 127, -127, 0, 32767));
  cases.push_back(constant_case("input_least", p, -128, -127, 0, 32767));
  cases.push_back(constant_case("input_least_weights_greatest", p, -128, 127, 0, 32767));
  cases.push_back(constant_case("multiplier_0", p, 127, 127, 1000, 0));
  cases.push_back(constant_case("multiplier_1", p, 127, 127, 1000, 1));
  // Biases that bring the sums to the bounds that the exporter promises: all in sum below 2^31.
  const s32 most = 2147483647 - 8 * 4 * 9 * 128 * 127;
  for (const int shift : {0, 1, 15, 16, 30, 31}) {
    convolve_params shifted = p;
    shifted.shift = shift;
    const s32 rounding = shift > 0 ? static_cast<s32>(1u << (shift - 1)) : 0;
    const std::string name = "shift_" + std::to_string(shift);
    const s32 bias = most - rounding;
    cases.push_back(constant_case(name + "_greatest", shifted, -128, -127, bias, 32767));
    cases.push_back(constant_case(name + "_least", shifted, -128, 127, -bias, 32767));
    cases.push_back(random_case(name + "_random", shifted, 1 << 18));
  }
  // Either side of the clamp to 16 bits, and of the last rounding: sums are the biases.
  convolve_params plain = layer(1, 1, 8, 1, 64, {1, 1, 1, 1, 0, 0}, 1, 0);
  std::vector<u32> ends;
  for (int i = 0; i < 256; ++i) {
    const s32 bias = i < 64 ? 32767 - 32 + i : i < 128 ? -32768 - 32 + i - 64 : (i - 192) * 64;
    ends.push_back(static_cast<u32>(bias));
    ends.push_back(i < 128 ? 16256u + static_cast<u32>(i) : 32767u - static_cast<u32>(i % 3));
  }
  cases.push_back(convolved("at_the_clamps", plain, constant_s8(8, 0), random_weights(256, 8), ends));
  plain.shift = 3;
  for (std::size_t i = 0; i < ends.size(); i += 2) ends[i] = ends[i] * 8u + static_cast<u32>(i / 2 % 8);
  cases.push_back(convolved("at_the_shifted_clamps", plain, constant_s8(8, 0), random_weights(256, 9), ends));
}

}  // namespace

std::vector<OpCase> convolve_cases() {
  std::vector<OpCase> cases;
  add_shapes(cases);
  add_extremes(cases);
  return cases;
}

}  // namespace berth::cases
