#include "pipeline/pipeline_statistics.hpp"

#include <cstring>

#include "monotonic.hpp"

namespace berth {

const char* name_of(Lap lap) {
  static constexpr std::array<const char*, kLaps> kNames = {"wait",    "device", "queue",  "decode",
                                                            "corners", "pose",   "latency"};
  return kNames[static_cast<std::size_t>(lap)];
}

const char* name_of(DropCause cause) {
  static constexpr std::array<const char*, kDropCauses> kNames = {"device", "host", "reader"};
  return kNames[static_cast<std::size_t>(cause)];
}

namespace {

/// One thread counts.
void count_one(std::atomic<u64>& counter) {
  counter.store(counter.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
}

}  // namespace

void PipelineStatistics::clear() {
  for (LatencyHistogram& lap : laps_) lap.clear();
  for (std::atomic<u64>* counter : {&run_again_, &device_lost_, &late_[0], &late_[1]}) *counter = 0;
}

void PipelineStatistics::count_run_again() { count_one(run_again_); }
void PipelineStatistics::count_device_lost() { count_one(device_lost_); }

void PipelineStatistics::take_times(PipelineSlot& slot, std::int64_t began_ns) {
  const std::int64_t now_ns = monotonic_ns();
  std::array<std::int64_t, kLaps>& ns = slot.frame.laps_ns;
  ns.fill(0);
  const auto lap = [&ns](Lap which) -> std::int64_t& { return ns[static_cast<std::size_t>(which)]; };
  lap(Lap::wait) = slot.taken_ns - slot.arrived_ns;
  lap(Lap::device) = slot.done_ns - slot.submitted_ns;
  lap(Lap::queue) = began_ns - slot.done_ns;
  if (slot.result.status != FrameStatus::device_lost) {
    lap(Lap::decode) = slot.result.times[1].ns;
    lap(Lap::pose) = slot.result.times[2].ns + slot.result.times[4].ns;
    if (slot.result.times[3].stage[0] != '\0') lap(Lap::corners) = slot.result.times[3].ns;
  }
  const FrameStamp& stamp = slot.result.stamp;
  const bool is_timed = std::strcmp(stamp.clock, "monotonic") == 0;
  lap(Lap::latency) = now_ns - (is_timed ? stamp.mid_exposure_ns : slot.arrived_ns);
  for (std::size_t i = 0; i < kLaps; ++i) laps_[i].add(ns[i]);
  for (std::size_t i = 0; i < late_.size(); ++i) {
    if (lap(Lap::latency) > deadlines_ns_[i]) count_one(late_[i]);
  }
}

void PipelineStatistics::add_to(PipelineCounts& counts) const {
  counts.run_again = run_again_;
  counts.device_lost = device_lost_;
  for (std::size_t i = 0; i < counts.late.size(); ++i) counts.late[i] = late_[i];
}

}  // namespace berth
