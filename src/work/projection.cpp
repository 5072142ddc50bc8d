#include "work/projection.hpp"

#include <algorithm>
#include <numeric>

namespace berth::work {
namespace {

std::size_t all_bytes(const StepTraffic& step) { return step.read + step.written; }

double cycles_of(const Counts& counts, const Machine& machine) {
  double cycles = 0;
  for (std::size_t k = 0; k < kKinds; ++k) cycles += static_cast<double>(counts[k]) * machine.cycles[k];
  return cycles;
}

double way_us(const StepWork& work, double cycles, const Machine& machine) {
  const double lane_cycles_us = machine.clock_ghz * machine.busy_share * 1e3;
  if (!machine.items_in_parallel) {
    // A group is one thread's: its share of the slots, in that thread's vectors.
    const double all = static_cast<double>(std::accumulate(work.slots[0].begin(), work.slots[0].end(), 0ULL));
    const double share = all > 0 ? static_cast<double>(work.most_in_group) / all : 0;
    return cycles * std::min(share, 1.0) / (machine.lanes * lane_cycles_us);
  }
  // A lane issues one operation a cycle, and waits for those it needs.
  const double steps_us = std::max(static_cast<double>(work.span) / (machine.clock_ghz * 1e3),
                                   static_cast<double>(work.steps) * machine.step_ns / 1e3);
  return steps_us + static_cast<double>(work.chain) * machine.latency_ns / 1e3;
}

}  // namespace

std::vector<std::size_t> bytes_from_memory(const FrameLoad& load, double cache_bytes) {
  std::vector<ArgumentTraffic> recent;  // last touched last
  // Touches a buffer; whether it has to come from memory.
  const auto misses = [&recent, cache_bytes](const ArgumentTraffic& argument) {
    double since = static_cast<double>(argument.bytes);
    bool known = false;
    for (auto at = recent.rbegin(); at != recent.rend() && !known; ++at) {
      known = at->buffer == argument.buffer;
      if (!known) since += static_cast<double>(at->bytes);
    }
    recent.erase(std::remove_if(recent.begin(), recent.end(),
                                [&](const ArgumentTraffic& one) { return one.buffer == argument.buffer; }),
                 recent.end());
    recent.push_back(argument);
    return !known || since > cache_bytes;
  };
  std::vector<std::size_t> missed;
  for (int frame = 0; frame < 2; ++frame) {  // the first leaves the cache as the second finds it
    missed.clear();
    for (const ArgumentTraffic& upload : load.uploads) misses(upload);
    for (const StepLoad& step : load.steps) {
      std::size_t bytes = 0;
      for (const ArgumentTraffic& argument : step.traffic.arguments) bytes += misses(argument) ? argument.bytes : 0;
      missed.push_back(bytes);
    }
  }
  return missed;
}

FrameTime project(const FrameLoad& load, const Machine& machine) {
  const std::vector<std::size_t> missed = bytes_from_memory(load, machine.cache_kb * 1024);
  const double memory_bytes_us = machine.memory_gb_s * machine.memory_share * 1e3;
  const double lanes_us = machine.units * machine.lanes * machine.clock_ghz * machine.busy_share * 1e3;
  FrameTime time;
  time.frame_us = machine.frame_us;
  time.us = machine.frame_us;
  for (std::size_t i = 0; i < load.steps.size(); ++i) {
    const StepWork& work = load.steps[i].work;
    const double cycles = cycles_of(work.slots[lockstep_index(machine.lockstep)], machine);
    StepTime step;
    step.bytes_us = static_cast<double>(missed[i]) / memory_bytes_us +
                    static_cast<double>(all_bytes(load.steps[i].traffic) - missed[i]) / (machine.cache_gb_s * 1e3);
    step.work_us = cycles / lanes_us;
    step.way_us = way_us(work, cycles, machine);
    step.us = machine.launch_us + std::max({step.bytes_us, step.work_us, step.way_us});
    time.us += step.us;
    time.steps.push_back(step);
  }
  for (const std::vector<ArgumentTraffic>* copies : {&load.uploads, &load.downloads}) {
    for (const ArgumentTraffic& copy : *copies) {
      time.copies_us += machine.copy_us + static_cast<double>(copy.bytes) / memory_bytes_us;
    }
  }
  time.us += time.copies_us;
  return time;
}

}  // namespace berth::work
