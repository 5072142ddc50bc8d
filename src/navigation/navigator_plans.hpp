#pragma once

#include <array>
#include <memory>
#include <vector>

#include "navigation/network_plan.hpp"

namespace berth {

/// Places looked at closely in one frame.
constexpr int kCloseLooks = 3;
/// Bounds of a window's pixel, 1/256 px of the frame.
constexpr int kMinStep = 256;
constexpr int kMaxStep = 2560;

/// A network on a device, with what frames of one size are run through: the search of the whole, looks at several
/// places at once, and at one. One thread at a time.
struct NavigatorPlans {
  NavigatorPlans(Backend& backend, Network network, int width, int height);
  NavigatorPlans(const NavigatorPlans&) = delete;
  NavigatorPlans& operator=(const NavigatorPlans&) = delete;

  /// Replays a plan and waits for its sums. Returns false when the device was lost.
  bool run(NetworkPlan& plan, std::vector<s32>& sums);
  /// Adds what the host's memory holds of it and no frame writes.
  void list_constants(std::vector<ConstantMemory>& to) const;

  Backend& backend;
  int width;
  int height;
  Network network;
  DeviceNetwork device;
  int padded_width;
  std::vector<u8> padded;
  std::unique_ptr<Buffer> frame;
  int step;
  int spacing;
  NetworkPlan search;
  NetworkPlan close;
  NetworkPlan follow;
  std::unique_ptr<Stream> stream;
  std::array<s32, 4> whole;  // the search's window
  std::vector<s32> search_sums;
  std::vector<s32> close_sums;  // follow's, too

 private:
  FrameView view() const { return {frame.get(), width, height, padded_width}; }
};

}  // namespace berth
