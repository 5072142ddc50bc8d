#pragma once

#include <memory>
#include <vector>

#include "berth/backend.hpp"
#include "buffer_list.hpp"
#include "navigation/network.hpp"

namespace berth {

/// A network's weights on a device, packed for the operations; made once, shared by its plans.
class DeviceNetwork {
 public:
  DeviceNetwork(Backend& backend, const Network& network);

  Backend& backend() const { return backend_; }
  const Network& network() const { return network_; }
  /// The buffers an operation reads beside its input, for each layer and last the heads: weights and channels; the
  /// table; none.
  const std::vector<std::vector<Buffer*>>& constants() const { return constants_; }
  std::size_t device_bytes() const { return buffers_.device_bytes(); }

 private:
  Buffer* add(Stream& stream, const void* data, std::size_t bytes);

  Backend& backend_;
  const Network& network_;
  BufferList buffers_;
  std::vector<std::vector<Buffer*>> constants_;
};

/// A padded frame on the device: u8[padded_height, padded_width] with a size of its own inside.
struct FrameView {
  Buffer* pixels;
  int width;
  int height;
  int padded_width;
};

/// The list of operations from a frame to the sums of the heads, for a fixed number of windows of one size. A window
/// larger than the network's input gives a grid of positions: the network as a convolution over it.
class NetworkPlan {
 public:
  /// `width` and `height` of a window, px, multiples of 4 and at least the network's side. Throws Error.
  NetworkPlan(const DeviceNetwork& device, const FrameView& frame, int windows, int width, int height);

  Plan& plan() { return *plan_; }
  const std::vector<Step>& steps() const { return steps_; }
  void list_constants(std::vector<ConstantMemory>& to) const { plan_->list_constants(to); }
  /// s32[windows, 4]: x, y of the corner and step in 1/256 px of the frame, 0; to be uploaded before a replay.
  Buffer& windows() { return *windows_; }
  /// s32[windows, grid_height, grid_width, sums_each]: what network_output reads.
  Buffer& sums() { return *sums_; }
  int sums_each() const { return sums_each_; }
  /// Of a window, px.
  int width() const { return width_; }
  int height() const { return height_; }
  int grid_height() const { return grid_height_; }
  int grid_width() const { return grid_width_; }
  std::size_t device_bytes() const { return buffers_.device_bytes(); }

 private:
  Buffer* add_input(const FrameView& frame, int count);

  const DeviceNetwork& device_;
  int width_;
  int height_;
  BufferList buffers_;
  std::vector<Step> steps_;
  std::unique_ptr<Plan> plan_;
  Buffer* windows_ = nullptr;
  Buffer* sums_ = nullptr;
  int sums_each_ = 0;
  int grid_height_ = 0;
  int grid_width_ = 0;
};

}  // namespace berth
