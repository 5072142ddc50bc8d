#include "navigation/network_plan.hpp"

#include <string>

#include "berth/error.hpp"
#include "divide_up.hpp"

namespace berth {
namespace {

/// Most pixels that window_statistics may count.
constexpr int kMaxCountedPixels = 66051;

// Work-items of a launch; kernels/ops.h.
int items_of(const convolve_params& p) {
  return p.count * p.out_height * divide_up(p.out_width, CONVOLVE_PIXELS) * p.out_words;
}
int items_of(const fully_connected_params& p) {
  return divide_up(p.out_channels / 4, FULLY_CONNECTED_WORDS) *
         divide_up(p.count * p.grid_height * p.grid_width, FULLY_CONNECTED_POSITIONS) * kGroupSize;
}

u32 byte_of(signed char value, int place) { return static_cast<u32>(static_cast<unsigned char>(value)) << (8 * place); }

/// u32[kernel_height, kernel_width, group_words, out_channels], four input channels of the output channel's group a
/// word.
std::vector<u32> packed_weights(const ConvolveLayer& layer) {
  const int each = layer.in_channels / layer.groups;
  const int group_words = (each + 3) / 4;
  std::vector<u32> packed(static_cast<std::size_t>(layer.kernel_height * layer.kernel_width * group_words) *
                          static_cast<std::size_t>(layer.out_channels));
  std::size_t from = 0;
  for (int out = 0; out < layer.out_channels; ++out) {
    for (int channel = 0; channel < each; ++channel) {
      for (int ky = 0; ky < layer.kernel_height; ++ky) {
        for (int kx = 0; kx < layer.kernel_width; ++kx) {
          const int word = (ky * layer.kernel_width + kx) * group_words + channel / 4;
          packed[static_cast<std::size_t>(word) * static_cast<std::size_t>(layer.out_channels) +
                 static_cast<std::size_t>(out)] |= byte_of(layer.weights[from++], channel % 4);
        }
      }
    }
  }
  return packed;
}

/// u32[out_channels, pixels, words] from s8[outputs, pixels, channels]; outputs past the last are 0.
std::vector<u32> packed_rows(const std::vector<signed char>& weights, int outputs, int pixels, int channels,
                             int out_channels) {
  const std::size_t words = static_cast<std::size_t>((channels + 3) / 4);
  std::vector<u32> packed(static_cast<std::size_t>(out_channels * pixels) * words);
  std::size_t from = 0;
  for (std::size_t row = 0; row < static_cast<std::size_t>(outputs * pixels); ++row) {
    for (int channel = 0; channel < channels; ++channel) {
      packed[row * words + static_cast<std::size_t>(channel / 4)] |= byte_of(weights[from++], channel % 4);
    }
  }
  return packed;
}

/// s32[out_channels, 2]: bias, multiplier.
std::vector<s32> channel_pairs(const std::vector<s32>& bias, const std::vector<s32>& multipliers, int out_channels) {
  std::vector<s32> pairs(static_cast<std::size_t>(out_channels) * 2);
  for (std::size_t i = 0; i < bias.size(); ++i) {
    pairs[2 * i] = bias[i];
    if (!multipliers.empty()) pairs[2 * i + 1] = multipliers[i];
  }
  return pairs;
}

}  // namespace

DeviceNetwork::DeviceNetwork(Backend& backend, const Network& network)
    : backend_(backend), network_(network), buffers_(backend) {
  const std::unique_ptr<Stream> stream = backend.make_stream();
  const auto weighted = [&](const std::vector<u32>& weights, const std::vector<s32>& channels) {
    constants_.push_back(
        {add(*stream, weights.data(), weights.size() * 4), add(*stream, channels.data(), channels.size() * 4)});
  };
  for (const Layer& layer : network.layers) {
    if (const auto* convolve = std::get_if<ConvolveLayer>(&layer)) {
      weighted(packed_weights(*convolve), channel_pairs(convolve->bias, convolve->multipliers, convolve->out_channels));
    } else if (const auto* norm = std::get_if<LocalResponseNormLayer>(&layer)) {
      constants_.push_back({add(*stream, norm->table.data(), sizeof norm->table)});
    } else if (const auto* full = std::get_if<FullyConnectedLayer>(&layer)) {
      weighted(packed_rows(full->weights, full->out_channels, full->rows * full->columns, full->in_channels,
                           full->out_channels),
               channel_pairs(full->bias, full->multipliers, full->out_channels));
    } else {
      constants_.emplace_back();
    }
  }
  const Heads& heads = network.heads;
  const int outputs = heads.scores + heads.geometry;
  const int out_channels = round_up(outputs, 4);
  weighted(packed_rows(heads.weights, outputs, 1, heads.in_channels, out_channels),
           channel_pairs(heads.bias, {}, out_channels));
}

Buffer* DeviceNetwork::add(Stream& stream, const void* data, std::size_t bytes) {
  Buffer* buffer = buffers_.make(bytes / 4);
  upload_at_start(backend_, stream, *buffer, data, bytes);
  return buffer;
}

namespace {

/// The step of a layer from one tensor to the next.
struct LayerStep {
  int count;
  Shape in;
  Shape out;
  Buffer* input;
  const std::vector<Buffer*>& constants;
  Buffer* output;

  Step operator()(const ConvolveLayer& layer) const {
    convolve_params p{};
    p.count = count;
    p.height = in.height;
    p.width = in.width;
    p.words = in.words();
    p.out_height = out.height;
    p.out_width = out.width;
    p.out_words = out.words();
    p.kernel_height = layer.kernel_height;
    p.kernel_width = layer.kernel_width;
    p.stride_y = layer.stride_y;
    p.stride_x = layer.stride_x;
    p.pad_y = layer.pad_y;
    p.pad_x = layer.pad_x;
    p.group_words = in.words() / layer.groups;
    p.group_out_words = out.words() / layer.groups;
    p.shift = layer.shift;
    return make_step(p, {input, constants[0], constants[1], output}, items_of(p));
  }
  Step operator()(const LocalResponseNormLayer&) const {
    const local_response_norm_params p{count * in.height * in.width, in.words()};
    return make_step(p, {input, constants[0], output}, p.pixels * p.words);
  }
  Step operator()(const MaxPoolLayer& layer) const {
    const max_pool_params p{count, in.height, in.width, in.words(), out.height, out.width, layer.kernel, layer.stride};
    return make_step(p, {input, output}, count * out.height * out.width * out.words());
  }
  Step operator()(const FullyConnectedLayer& layer) const {
    return fully_connected(layer.rows, layer.columns, layer.out_channels, layer.shift);
  }
  Step fully_connected(int rows, int columns, int out_channels, int shift) const {
    fully_connected_params p{};
    p.count = count;
    p.height = in.height;
    p.width = in.width;
    p.words = in.words();
    p.rows = rows;
    p.columns = columns;
    p.grid_height = out.height;
    p.grid_width = out.width;
    p.out_channels = out_channels;
    p.shift = shift;
    return make_step(p, {input, constants[0], constants[1], output}, items_of(p));
  }
};

std::size_t tensor_words(const Shape& shape, int count) {
  return static_cast<std::size_t>(count) * static_cast<std::size_t>(shape.height * shape.width) *
         static_cast<std::size_t>(shape.words());
}

}  // namespace

NetworkPlan::NetworkPlan(const DeviceNetwork& device, const FrameView& frame, int windows, int width, int height)
    : device_(device), width_(width), height_(height), buffers_(device.backend()) {
  const Network& network = device.network();
  if (width % 4 != 0 || width < network.side || height < network.side) {
    throw Error("a window of " + std::to_string(width) + "x" + std::to_string(height) +
                " px; give at least the network's " + std::to_string(network.side) + ", its width a multiple of 4");
  }
  const std::vector<Shape> shapes = network.shapes(height, width);
  Buffer* tensor = add_input(frame, windows);
  for (std::size_t i = 0; i < network.layers.size(); ++i) {
    Buffer* output = buffers_.make(tensor_words(shapes[i + 1], windows));
    steps_.push_back(std::visit(LayerStep{windows, shapes[i], shapes[i + 1], tensor, device.constants()[i], output},
                                network.layers[i]));
    tensor = output;
  }
  const Shape& last = shapes.back();
  grid_height_ = last.height;
  grid_width_ = last.width;
  sums_each_ = round_up(network.heads.scores + network.heads.geometry, 4);
  sums_ = buffers_.make(static_cast<std::size_t>(windows * grid_height_ * grid_width_ * sums_each_));
  steps_.push_back(
      LayerStep{windows, last, last, tensor, device.constants().back(), sums_}.fully_connected(1, 1, sums_each_, -1));
  plan_ = device.backend().record(steps_);
}

Buffer* NetworkPlan::add_input(const FrameView& frame, int count) {
  const Network& network = device_.network();
  const int words = width_ / 4 * height_;
  const int all = count * words;
  windows_ = buffers_.make(static_cast<std::size_t>(count) * 4);
  Buffer* pixels = buffers_.make(static_cast<std::size_t>(all));
  Buffer* statistics = buffers_.make(static_cast<std::size_t>(count) * 2);
  Buffer* input = buffers_.make(static_cast<std::size_t>(all));
  steps_.push_back(
      make_step(extract_window_params{frame.width, frame.height, frame.padded_width / 4, count, width_ / 4, height_},
                {frame.pixels, windows_, pixels}, all));
  if (network.normalise) {
    const int stride = (words - 1) / (kMaxCountedPixels / 4) + 1;
    steps_.push_back(
        make_step(window_statistics_params{count, words, stride}, {pixels, statistics}, count * kGroupSize));
  } else {
    std::vector<s32> fixed;
    for (int i = 0; i < count; ++i) fixed.insert(fixed.end(), {network.mean, 256});
    upload_at_start(device_.backend(), *device_.backend().make_stream(), *statistics, fixed.data(), fixed.size() * 4);
  }
  steps_.push_back(make_step(normalize_window_params{count, words}, {pixels, statistics, input}, all));
  return input;
}

}  // namespace berth
