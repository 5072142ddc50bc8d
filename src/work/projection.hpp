#pragma once

#include <vector>

#include "frame/traffic.hpp"
#include "work/counts.hpp"
#include "work/machine.hpp"

namespace berth::work {

/// A launch as counted: what it moves and what it does.
struct StepLoad {
  StepTraffic traffic;
  StepWork work;
};

/// A plan as counted, with the copies before and after it.
struct FrameLoad {
  std::vector<StepLoad> steps;
  std::vector<ArgumentTraffic> uploads, downloads;
};

/// What a launch is predicted to take, and why, µs.
struct StepTime {
  /// From memory and from the cache, at their bandwidths.
  double bytes_us = 0;
  /// All items' operations on all lanes.
  double work_us = 0;
  /// The longest work-group: what no number of lanes makes faster.
  double way_us = 0;
  /// The launch itself, and the longest of the three.
  double us = 0;
};
struct FrameTime {
  std::vector<StepTime> steps;
  double copies_us = 0;
  double frame_us = 0;  // what a replay costs once
  double us = 0;
};

/// The bytes of a frame's arguments that come from memory, step by step: a buffer is in the cache if all that was
/// touched since it was last, it included, fits. For a frame after another like it.
std::vector<std::size_t> bytes_from_memory(const FrameLoad& load, double cache_bytes);

/// See docs/projection.md.
FrameTime project(const FrameLoad& load, const Machine& machine);

}  // namespace berth::work
