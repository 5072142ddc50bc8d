#pragma once

#include <ostream>
#include <vector>

#include "berth/pipeline.hpp"
#include "frame_json.hpp"

namespace berth::cli {

/// "pipeline    4 slots: 11.2 MB for the device, …; cores 0, 1; SCHED_FIFO 50"
void print_set_up(std::ostream& out, const PipelineMemory& memory, const std::vector<int>& cores, int realtime);
/// "300 frames offered, 294 delivered, 6 dropped (waiting for …)", without an end of line.
void print_counts(std::ostream& out, const PipelineCounts& counts);
/// A row of percentiles for each lap, ms.
void print_laps(std::ostream& out, const Pipeline& pipeline);
/// "later than 14.3 ms: 0 of 300; than 33 ms: 0 of 300"
void print_late(std::ostream& out, const std::vector<double>& deadlines_ms, const std::array<u64, 2>& late, u64 of);
/// Counts and laps: what `berth run --fps` logs at its end.
Json to_json(const Pipeline& pipeline, const std::vector<double>& deadlines_ms);

}  // namespace berth::cli
