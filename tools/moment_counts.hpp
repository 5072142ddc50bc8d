#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "berth/station_pairing.hpp"

namespace berth::cli {

/// What moments came to so far.
struct MomentCounts {
  u64 moments = 0, by_both = 0, by_robot = 0, by_dock = 0, disagreed = 0;
  /// Of paired mid-exposures.
  std::int64_t largest_difference_ns = 0;

  u64 without_pose() const { return moments - by_both - by_robot - by_dock; }

  void add(const StationMoment& moment, const FusedPose& fused) {
    const bool both = fused.used[0] && fused.used[1];
    ++moments;
    by_both += both ? 1 : 0;
    by_robot += fused.used[0] && !both ? 1 : 0;
    by_dock += fused.used[1] && !both ? 1 : 0;
    disagreed += fused.disagree ? 1 : 0;
    if (moment.came[0] && moment.came[1]) {
      largest_difference_ns = std::max(largest_difference_ns, std::abs(moment.difference_ns));
    }
  }
};

}  // namespace berth::cli
