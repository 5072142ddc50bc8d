#pragma once

#include <array>
#include <atomic>
#include <cstdint>

#include "berth/pipeline.hpp"
#include "pipeline/pipeline_slot.hpp"

namespace berth {

/// How long frames took, and what is counted of them beside the ring's drops. The host's thread writes, any may read;
/// allocates nothing.
class PipelineStatistics {
 public:
  explicit PipelineStatistics(const std::array<std::int64_t, 2>& deadlines_ns) : deadlines_ns_(deadlines_ns) {}

  /// Between two runs.
  void clear();
  void count_run_again();
  void count_device_lost();
  /// Takes the times of a frame whose result stands just now; the host took it up at `began_ns`.
  void take_times(PipelineSlot& slot, std::int64_t began_ns);

  void add_to(PipelineCounts& counts) const;
  const LatencyHistogram& times(Lap lap) const { return laps_[static_cast<std::size_t>(lap)]; }

 private:
  const std::array<std::int64_t, 2> deadlines_ns_;
  std::atomic<u64> run_again_ = 0, device_lost_ = 0;
  std::array<std::atomic<u64>, 2> late_ = {};
  std::array<LatencyHistogram, kLaps> laps_;
};

}  // namespace berth
