#pragma once

#include <array>
#include <ostream>

#include "berth/station_pairing.hpp"

namespace berth::cli {

/// By StationSide.
using BothCounts = std::array<StationCounts, kStationSides>;

/// One moment of two stations, and what it came to. Everything in it is valid during the call only.
struct ObservedMoment {
  const StationMoment& moment;
  const FusedPose& fused;
  /// What became of the stations' frames so far.
  const BothCounts& counts;
  /// Frames come at a pace of their own and are dropped where nobody takes them; else they wait.
  bool is_live = false;
};

/// Whoever wants to have every moment of `berth stations`. All calls come from one thread, in the moments' order; while
/// it is held up the stations' frames wait in a short queue, so what waits for a disk or a network has a queue and a
/// thread of its own.
class MomentObserver {
 public:
  virtual ~MomentObserver() = default;
  /// Once, before the stations begin.
  virtual void begin() {}
  virtual void observe(const ObservedMoment& observed) = 0;
  /// Once, after the last moment: `people` is for a line on what became of them. Throws Error where something went
  /// wrong.
  virtual void finish(const BothCounts& counts, std::ostream& people) = 0;
};

}  // namespace berth::cli
