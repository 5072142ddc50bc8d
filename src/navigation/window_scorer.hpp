#pragma once

#include <memory>
#include <vector>

#include "navigation/network_output.hpp"
#include "navigation/network_plan.hpp"

namespace berth {

/// What the network gives for one image of its own size.
struct WindowScore {
  std::vector<s32> sums;  // of the heads
  NetworkOutput output;
};

/// Runs a network over images of its own size, several a launch: for evaluation and comparison.
class WindowScorer {
 public:
  WindowScorer(Backend& backend, const Network& network, int batch);

  /// `count` images, at most `batch`, behind each other. Throws Error when the device is lost.
  std::vector<WindowScore> score(const u8* images, int count);

 private:
  const Network& network_;
  DeviceNetwork device_;
  std::unique_ptr<Buffer> frame_;
  NetworkPlan plan_;
  std::unique_ptr<Stream> stream_;
  std::vector<u8> pixels_;
  std::vector<s32> sums_;
};

}  // namespace berth
