#include "work/frames.hpp"

#include <cstring>

#include "berth/error.hpp"
#include "divide_up.hpp"
#include "work/count_step.hpp"

namespace berth::work {
namespace {

class DockingFrame final : public ModeFrame {
 public:
  DockingFrame(Backend& backend, View2D<const u8> image)
      : plan_(backend, image.width, image.height, {}), padded_(plan_.geometry().frame_bytes()) {
    pad_frame(image, plan_.geometry(), padded_.data());
    for (const MarkerSearch& search : plan_.searches()) {
      for (Buffer* list : {search.contours, search.quads, search.edges}) {
        lists_.push_back(list);
        room_.emplace_back(list->bytes());
      }
    }
  }
  void upload(Stream& stream) override { stream.upload(plan_.frame(), padded_.data(), padded_.size()); }
  void download(Stream& stream) override {
    for (std::size_t i = 0; i < lists_.size(); ++i) stream.download(*lists_[i], room_[i].data(), room_[i].size());
  }
  Plan& plan() override { return plan_.plan(); }
  const std::vector<Step>& steps() const override { return plan_.steps(); }
  std::vector<StepTraffic> traffic(Stream& stream) override {
    StageReader reader(plan_, stream);
    return step_traffic(reader);
  }
  std::vector<ArgumentTraffic> uploads() override { return {{&plan_.frame(), padded_.size()}}; }
  std::vector<ArgumentTraffic> downloads() override {
    std::vector<ArgumentTraffic> copies;
    for (Buffer* list : lists_) copies.push_back({list, list->bytes()});
    return copies;
  }

 private:
  MarkerPlan plan_;
  std::vector<u8> padded_;
  std::vector<Buffer*> lists_;
  std::vector<std::vector<std::byte>> room_;
};

class NetworkFrame final : public ModeFrame {
 public:
  NetworkFrame(Backend& backend, View2D<const u8> image, const Network& network, int width, int height)
      : padded_width_(round_up(image.width, 4)),
        padded_(static_cast<std::size_t>(padded_width_) * static_cast<std::size_t>(image.height)),
        frame_(backend.make_buffer(padded_.size())),
        device_(backend, network),
        plan_(device_, {frame_.get(), image.width, image.height, padded_width_}, 1, width, height),
        window_{(image.width - width) / 2 * 256, (image.height - height) / 2 * 256, 256, 0},
        sums_(plan_.sums().bytes()) {
    for (int y = 0; y < image.height; ++y) {
      std::memcpy(padded_.data() + static_cast<std::ptrdiff_t>(y) * padded_width_, image.row(y),
                  static_cast<std::size_t>(image.width));
    }
  }
  void upload(Stream& stream) override {
    stream.upload(*frame_, padded_.data(), padded_.size());
    stream.upload(plan_.windows(), window_.data(), sizeof window_);
  }
  void download(Stream& stream) override { stream.download(plan_.sums(), sums_.data(), sums_.size()); }
  Plan& plan() override { return plan_.plan(); }
  const std::vector<Step>& steps() const override { return plan_.steps(); }
  std::vector<StepTraffic> traffic(Stream&) override { return step_traffic(plan_.steps()); }
  std::vector<ArgumentTraffic> uploads() override {
    return {{frame_.get(), padded_.size()}, {&plan_.windows(), sizeof window_}};
  }
  std::vector<ArgumentTraffic> downloads() override { return {{&plan_.sums(), sums_.size()}}; }

 private:
  int padded_width_;
  std::vector<u8> padded_;
  std::unique_ptr<Buffer> frame_;
  DeviceNetwork device_;
  NetworkPlan plan_;
  std::array<s32, 4> window_;
  std::vector<std::byte> sums_;
};

/// Small weights that differ, none of them -128.
std::vector<signed char> some_weights(std::size_t count) {
  std::vector<signed char> weights(count);
  u32 state = 1;
  for (signed char& weight : weights) {
    state = state * 1664525u + 1013904223u;
    weight = static_cast<signed char>(static_cast<int>(state >> 28) - 8);
  }
  return weights;
}

// Keep activations alive: sums of n products of weights up to 8 and activations up to 127 are some thousands.
constexpr int kShift = 6;
constexpr s32 kMultiplier = 16384;

ConvolveLayer convolve(int in, int out, int rows, int columns, int stride_y, int pad, int groups) {
  ConvolveLayer layer;
  layer.in_channels = in;
  layer.out_channels = out;
  layer.kernel_height = rows;
  layer.kernel_width = columns;
  layer.stride_y = stride_y;
  layer.pad_y = layer.pad_x = pad;
  layer.groups = groups;
  layer.shift = kShift;
  layer.weights = some_weights(static_cast<std::size_t>(out * (in / groups) * rows * columns));
  layer.bias.assign(static_cast<std::size_t>(out), 0);
  layer.multipliers.assign(static_cast<std::size_t>(out), kMultiplier);
  return layer;
}

FullyConnectedLayer fully_connected(int in, int side, int out) {
  FullyConnectedLayer layer;
  layer.in_channels = in;
  layer.rows = layer.columns = side;
  layer.out_channels = out;
  layer.shift = kShift;
  layer.weights = some_weights(static_cast<std::size_t>(out) * static_cast<std::size_t>(in * side * side));
  layer.bias.assign(static_cast<std::size_t>(out), 0);
  layer.multipliers.assign(static_cast<std::size_t>(out), kMultiplier);
  return layer;
}

}  // namespace

std::unique_ptr<ModeFrame> docking_frame(Backend& backend, View2D<const u8> image) {
  return std::make_unique<DockingFrame>(backend, image);
}

std::unique_ptr<ModeFrame> network_frame(Backend& backend, View2D<const u8> image, const Network& network, int width,
                                         int height) {
  return std::make_unique<NetworkFrame>(backend, image, network, width, height);
}

int search_side(int frame_side, int network_side) { return network_side + round_up(frame_side - 64, 32); }

FrameLoad count_frame(ModeFrame& frame, Backend& backend, int every) {
  const std::unique_ptr<Stream> stream = backend.make_stream();
  frame.upload(*stream);
  if (!stream->finish()) throw Error(std::string(backend.name()) + ": the device was lost");
  std::vector<StepWork> counted;
  for (const Step& step : frame.steps()) counted.push_back(count_step(step, every));
  const std::vector<StepTraffic> traffic = frame.traffic(*stream);
  FrameLoad load;
  for (std::size_t i = 0; i < counted.size(); ++i) load.steps.push_back({traffic[i], counted[i]});
  load.uploads = frame.uploads();
  load.downloads = frame.downloads();
  return load;
}

Network paper_sized_network() {
  Network network;
  network.name = "paper-sized";
  const LocalResponseNormLayer norm{[] {
    std::array<s32, 104> table{};
    table.fill(16384);  // a factor of 1
    return table;
  }()};
  const MaxPoolLayer pool{3, 2};
  // Four pixels a word: 11 columns are 3 words, a stride of 4 one.
  network.layers = {convolve(4, 96, 11, 3, 4, 0, 1),
                    norm,
                    pool,
                    convolve(96, 256, 5, 5, 1, 2, 2),
                    norm,
                    pool,
                    convolve(256, 384, 3, 3, 1, 1, 1),
                    norm,
                    convolve(384, 384, 3, 3, 1, 1, 2),
                    norm,
                    convolve(384, 256, 3, 3, 1, 1, 2),
                    norm,
                    pool,
                    fully_connected(256, 6, 4096),
                    fully_connected(4096, 1, 4096)};
  network.heads.in_channels = 4096;
  network.heads.weights = some_weights(5 * 4096);
  network.heads.bias.assign(5, 0);
  return network;
}

}  // namespace berth::work
