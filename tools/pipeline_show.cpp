#include "pipeline_show.hpp"

#include <fmt/format.h>
#include <fmt/ranges.h>

#include <array>
#include <utility>

#include "health_show.hpp"

namespace berth::cli {
namespace {

constexpr std::array<std::pair<const char*, double>, 3> kQuantiles = {{{"p50", 0.5}, {"p99", 0.99}, {"p99.9", 0.999}}};

double megabytes(std::size_t bytes) { return static_cast<double>(bytes) / 1e6; }

}  // namespace

void print_set_up(std::ostream& out, const PipelineMemory& memory, const std::vector<int>& cores, int realtime) {
  out << fmt::format("pipeline    {} slots: {:.1f} MB for the device, {:.1f} MB for the host, no more after this",
                     memory.slots, megabytes(memory.device_bytes), megabytes(memory.host_bytes));
  if (!cores.empty()) out << fmt::format("; cores {}", fmt::join(cores, ", "));
  if (realtime > 0) out << fmt::format("; SCHED_FIFO {}", realtime);
  out << '\n';
}

void print_counts(std::ostream& out, const PipelineCounts& counts) {
  out << fmt::format("{} frames offered, {} delivered, {} dropped", counts.offered, counts.delivered,
                     counts.all_dropped());
  if (counts.all_dropped() > 0) {
    out << fmt::format(" (waiting for device {}, host {}, reader {})", counts.dropped[0], counts.dropped[1],
                       counts.dropped[2]);
  }
  if (counts.run_again > 0) out << fmt::format(", {} run again on another backend", counts.run_again);
}

void print_laps(std::ostream& out, const Pipeline& pipeline) {
  out << fmt::format("{:<11} {:>9} {:>9} {:>9} {:>9}  ms\n", "", "p50", "p99", "p99.9", "max");
  for (std::size_t i = 0; i < kLaps; ++i) {
    const LatencyHistogram& times = pipeline.times(static_cast<Lap>(i));
    if (times.max() == 0) continue;
    out << fmt::format("{:<11}", name_of(static_cast<Lap>(i)));
    for (const auto& [name, share] : kQuantiles) out << fmt::format(" {:>9.3f}", ms_of(times.quantile(share)));
    out << fmt::format(" {:>9.3f}\n", ms_of(times.max()));
  }
}

void print_late(std::ostream& out, const std::vector<double>& deadlines_ms, const std::array<u64, 2>& late, u64 of) {
  for (std::size_t i = 0; i < deadlines_ms.size(); ++i) {
    out << fmt::format("{} {:g} ms: {} of {}", i == 0 ? "later than" : "; than", deadlines_ms[i], late[i], of);
  }
  out << '\n';
}

Json to_json(const Pipeline& pipeline, const std::vector<double>& deadlines_ms) {
  const PipelineCounts counts = pipeline.counts();
  Json json = {{"offered", counts.offered}, {"delivered", counts.delivered}, {"run_again", counts.run_again}};
  for (std::size_t i = 0; i < kDropCauses; ++i) {
    json["dropped"][name_of(static_cast<DropCause>(i))] = counts.dropped[i];
  }
  json["health"] = to_json(pipeline.health());
  for (std::size_t i = 0; i < deadlines_ms.size(); ++i) {
    json["late"].push_back({{"deadline_ms", deadlines_ms[i]}, {"frames", counts.late[i]}});
  }
  for (std::size_t i = 0; i < kLaps; ++i) {
    const LatencyHistogram& times = pipeline.times(static_cast<Lap>(i));
    Json& row = json["times_ms"][name_of(static_cast<Lap>(i))];
    for (const auto& [name, share] : kQuantiles) row[name] = ms_of(times.quantile(share));
    row["max"] = ms_of(times.max());
  }
  return json;
}

}  // namespace berth::cli
