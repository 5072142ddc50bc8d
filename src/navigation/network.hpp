#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <string>
#include <variant>
#include <vector>

#include "berth/types.hpp"

namespace berth {

/// Activations after a layer: rows, columns and channels of one tensor.
struct Shape {
  int height = 0;
  int width = 0;
  int channels = 0;
  int words() const { return (channels + 3) / 4; }
};

/// Weights are s8[out][in / groups][ky][kx]; see docs/network-arithmetic.md.
struct ConvolveLayer {
  int in_channels = 0;
  int out_channels = 0;
  int kernel_height = 0;
  int kernel_width = 0;
  int stride_y = 1;
  int stride_x = 1;
  int pad_y = 0;
  int pad_x = 0;
  int groups = 1;
  int shift = 0;
  std::vector<signed char> weights;
  std::vector<s32> bias;
  std::vector<s32> multipliers;
};

struct LocalResponseNormLayer {
  std::array<s32, 104> table{};
};

struct MaxPoolLayer {
  int kernel = 0;
  int stride = 0;
};

/// Weights are s8[out][row][column][channel].
struct FullyConnectedLayer {
  int in_channels = 0;
  int rows = 1;
  int columns = 1;
  int out_channels = 0;
  int shift = 0;
  std::vector<signed char> weights;
  std::vector<s32> bias;
  std::vector<s32> multipliers;
};

using Layer = std::variant<ConvolveLayer, LocalResponseNormLayer, MaxPoolLayer, FullyConnectedLayer>;
/// Its kind as docs/network-arithmetic.md spells it: "convolve", …
const char* name_of(const Layer& layer);

/// The last layer: two scores, then the geometry's three numbers or none. Weights are s8[out][in].
struct Heads {
  int in_channels = 0;
  int scores = 2;
  int geometry = 3;
  std::vector<signed char> weights;
  std::vector<s32> bias;
};

/// (v * multiplier + 2^(shift - 1)) >> shift, held to ±2^30; |v| < 2^32.
struct FixedScale {
  s32 multiplier = 0;
  int shift = 1;
  s32 apply(std::int64_t value) const;
};

/// A navigation network of integers, checked: its layers fit together and no sum leaves 32 bits.
struct Network {
  std::string name;
  std::string notes;
  int side = 256;         ///< of its input, px
  bool normalise = true;  ///< statistics of each window; else `mean` and a gain of 1
  int mean = 128;         ///< grey levels
  std::vector<Layer> layers;
  Heads heads;
  /// From the heads' sums to a logit in 1/256 and to geometry: see network_output.hpp.
  FixedScale score, x, y, d;
  std::array<unsigned short, 4096> logistic{};

  /// After each layer for an input of `height` x `width` px (a width that is a multiple of 4), the input itself first.
  /// The fully connected ones see a tensor larger than their kernel as a grid of positions one pixel apart.
  std::vector<Shape> shapes(int height, int width) const;
  std::size_t parameters() const;
};

/// Reads a model file (docs/network-arithmetic.md). Throws Error naming the file, the layer, the value and the remedy
/// on anything that is not one, whole and consistent.
Network read_network(const std::string& path);
/// The same of bytes; `name` stands for the file in errors.
Network parse_network(const unsigned char* bytes, std::size_t count, const std::string& name);
/// What read_network reads.
std::vector<unsigned char> network_bytes(const Network& network);

}  // namespace berth
