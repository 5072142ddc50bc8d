#pragma once

#include <cstddef>
#include <vector>

#include "frame/stages.hpp"

namespace berth {

/// What an argument of a launch held of the last frame, each byte counted once.
struct ArgumentTraffic {
  const Buffer* buffer = nullptr;
  std::size_t bytes = 0;
};

/// What one launch of a plan moved for the last frame.
struct StepTraffic {
  Op op;
  int groups = 0;
  /// In the order of args_of(op).
  std::vector<ArgumentTraffic> arguments;
  /// Bytes of the arguments it reads and of those it writes, each counted once: whole images and tables, and of lists
  /// what the frame filled. A cache may save some, an uncoalesced access cost more.
  std::size_t read = 0;
  std::size_t written = 0;
};

/// Of steps whose buffers are moved whole.
std::vector<StepTraffic> step_traffic(const std::vector<Step>& steps);
/// Of every step of the reader's plan, in order.
std::vector<StepTraffic> step_traffic(StageReader& reader);

}  // namespace berth
