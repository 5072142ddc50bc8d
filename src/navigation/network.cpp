#include "navigation/network.hpp"

#include <algorithm>
#include <cstdlib>

#include "berth/error.hpp"
#include "navigation/network_check.hpp"

namespace berth {
namespace {

std::string text_of(const Shape& shape) {
  return std::to_string(shape.height) + "x" + std::to_string(shape.width) + "x" + std::to_string(shape.channels);
}

/// The shape after a layer; without rows or columns where it does not fit.
struct NextShape {
  Shape in;
  Shape operator()(const ConvolveLayer& layer) const {
    return {size(in.height + 2 * layer.pad_y, layer.kernel_height, layer.stride_y),
            size(in.width + 2 * layer.pad_x, layer.kernel_width, layer.stride_x), layer.out_channels};
  }
  Shape operator()(const LocalResponseNormLayer&) const { return in; }
  Shape operator()(const MaxPoolLayer& layer) const {
    return {size(in.height, layer.kernel, layer.stride), size(in.width, layer.kernel, layer.stride), in.channels};
  }
  Shape operator()(const FullyConnectedLayer& layer) const {
    return {size(in.height, layer.rows, 1), size(in.width, layer.columns, 1), layer.out_channels};
  }
  static int size(int length, int kernel, int stride) { return length < kernel ? 0 : (length - kernel) / stride + 1; }
};

class Check {
 public:
  explicit Check(std::string file) : file_(std::move(file)) {}

  void layer(std::size_t number, const Layer& layer, const Shape& in, const Shape& out) {
    where_ = "layer " + std::to_string(number) + " (" + name_of(layer) + ")";
    largest_ = number == 1 ? 128 : 127;
    in_ = in;
    std::visit([this](const auto& it) { values(it); }, layer);
    if (out.height < 1 || out.width < 1) fail("leaves nothing of a tensor of " + text_of(in));
    const long long bytes = static_cast<long long>(out.height) * out.width * out.words() * 4;
    if (bytes > kMaxTensorBytes) fail("makes a tensor of " + text_of(out) + ", above 16 MiB");
    if (out.channels % 4 != 0) fail("has " + std::to_string(out.channels) + " channels, not a multiple of 4");
  }
  void heads(const Heads& heads, const Shape& in) {
    where_ = "the heads";
    largest_ = 127;
    in_ = in;
    if (in.height != 1 || in.width != 1) fail("get a tensor of " + text_of(in) + ", not of one pixel");
    channels(heads.in_channels);
    sums(heads.weights, heads.bias, 0);
  }

 private:
  [[noreturn]] void fail(const std::string& what) const {
    throw Error(file_ + ": " + where_ + ": " + what + "; export the network again");
  }
  void channels(int wanted) const {
    if (wanted != in_.channels) {
      fail("in_channels is " + std::to_string(wanted) + ", what comes before gives " + std::to_string(in_.channels));
    }
  }
  void values(const ConvolveLayer& layer) const {
    channels(layer.in_channels);
    if (layer.pad_y >= layer.kernel_height || layer.pad_x >= layer.kernel_width) fail("padding as wide as the kernel");
    if (layer.groups > 1 && (layer.in_channels / layer.groups % 4 != 0 || layer.out_channels / layer.groups % 4 != 0)) {
      fail("a group's channels are not a multiple of 4");
    }
    sums(layer.weights, layer.bias, layer.shift);
    multipliers(layer.multipliers);
  }
  void values(const LocalResponseNormLayer&) const { not_first(); }
  void values(const MaxPoolLayer&) const { not_first(); }
  /// The input may be negative, activations not.
  void not_first() const {
    if (largest_ == 128) fail("comes before any convolution");
  }
  void values(const FullyConnectedLayer& layer) const {
    channels(layer.in_channels);
    sums(layer.weights, layer.bias, layer.shift);
    multipliers(layer.multipliers);
  }
  /// No sum of products, its bias and its rounding leaves 32 bits, in any order.
  void sums(const std::vector<signed char>& weights, const std::vector<s32>& bias, int shift) const {
    const std::size_t each = weights.size() / bias.size();
    for (std::size_t channel = 0; channel < bias.size(); ++channel) {
      long long bound = std::llabs(static_cast<long long>(bias[channel])) + (shift > 0 ? 1LL << (shift - 1) : 0);
      for (std::size_t i = channel * each; i < (channel + 1) * each; ++i) {
        if (weights[i] == -128) fail("a weight of -128");
        bound += static_cast<long long>(std::abs(static_cast<int>(weights[i]))) * largest_;
      }
      if (bound >= 1LL << 31) fail("the sum of channel " + std::to_string(channel) + " may leave 32 bits");
    }
  }
  void multipliers(const std::vector<s32>& values) const {
    for (const s32 value : values) {
      if (value < 0 || value > 32767) fail("a multiplier of " + std::to_string(value) + ", not within 0 to 32767");
    }
  }

  std::string file_;
  std::string where_;
  int largest_ = 127;
  Shape in_;
};

}  // namespace

const char* name_of(const Layer& layer) {
  struct Name {
    const char* operator()(const ConvolveLayer&) const { return "convolve"; }
    const char* operator()(const LocalResponseNormLayer&) const { return "local_response_norm"; }
    const char* operator()(const MaxPoolLayer&) const { return "max_pool"; }
    const char* operator()(const FullyConnectedLayer&) const { return "fully_connected"; }
  };
  return std::visit(Name(), layer);
}

s32 FixedScale::apply(std::int64_t value) const {
  constexpr std::int64_t kMost = 1 << 30;
  const std::int64_t product = value * multiplier;
  // (product + 2^(shift - 1)) >> shift, which could overflow.
  const std::int64_t scaled = (product >> shift) + (product >> (shift - 1) & 1);
  return static_cast<s32>(std::clamp(scaled, -kMost, kMost));
}

std::vector<Shape> Network::shapes(int height, int width) const {
  std::vector<Shape> shapes = {{height, width / 4, 4}};
  for (const Layer& layer : layers) shapes.push_back(std::visit(NextShape{shapes.back()}, layer));
  return shapes;
}

std::size_t Network::parameters() const {
  std::size_t count = heads.weights.size() + heads.bias.size();
  for (const Layer& layer : layers) {
    if (const auto* convolve = std::get_if<ConvolveLayer>(&layer))
      count += convolve->weights.size() + convolve->bias.size();
    if (const auto* full = std::get_if<FullyConnectedLayer>(&layer)) count += full->weights.size() + full->bias.size();
  }
  return count;
}

void check_network(const Network& network, const std::string& file) {
  if (network.side % 4 != 0) {
    throw Error(file + ": an input side of " + std::to_string(network.side) + " px, not a multiple of 4");
  }
  const std::vector<Shape> shapes = network.shapes(network.side, network.side);
  Check check(file);
  for (std::size_t i = 0; i < network.layers.size(); ++i) {
    check.layer(i + 1, network.layers[i], shapes[i], shapes[i + 1]);
  }
  check.heads(network.heads, shapes.back());
}

}  // namespace berth
