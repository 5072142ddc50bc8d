#pragma once

#include <cstddef>
#include <vector>

#include "frame/stages.hpp"

namespace berth {

/// What one launch of a plan moved for the last frame.
struct StepTraffic {
  Op op;
  int groups = 0;
  /// Bytes of the arguments it reads and of those it writes, each counted once: whole images and tables, and of lists
  /// what the frame filled. A cache may save some, an uncoalesced access cost more.
  std::size_t read = 0;
  std::size_t written = 0;
};

/// Of every step of the reader's plan, in order.
std::vector<StepTraffic> step_traffic(StageReader& reader);

}  // namespace berth
