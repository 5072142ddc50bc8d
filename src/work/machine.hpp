#pragma once

#include <array>
#include <string>

#include "work/counts.hpp"

namespace berth::work {

/// What a machine does in a time, as far as a frame's time can be told from it. Read from and written to TOML files;
/// bench/machines has some, docs/projection.md says what the fields mean.
struct Machine {
  std::string name;
  /// The backend that is meant.
  std::string backend;
  /// A work-group's items are spread over a unit's lanes (a GPU), or run one after the other in one thread's vectors.
  bool items_in_parallel = true;

  double memory_gb_s = 0;
  /// What of that a copy reaches.
  double memory_share = 1;
  double cache_kb = 0;
  double cache_gb_s = 0;
  /// Of a load whose address the load before gave, ns.
  double latency_ns = 0;

  int units = 1;
  int lanes = 1;     // of a unit
  int lockstep = 1;  // lanes that advance together, one of kLockstep
  double clock_ghz = 1;
  /// What of its lanes' cycles it makes use of.
  double busy_share = 1;
  /// A lane's cycles for one of each kind.
  std::array<double, kKinds> cycles = {};
  /// Of arithmetic whose input the step before gave, ns.
  double step_ns = 0;

  double frame_us = 0;  // once a plan's replay, until the host knows of its end
  double launch_us = 0;
  double copy_us = 0;  // to begin an upload or a download
};

/// Throws Error naming file, field, value and remedy on what is missing, unknown or out of bounds.
Machine read_machine(const std::string& path);
/// What read_machine reads, with `remark` (lines of text, may be empty) as comments at its head.
std::string machine_text(const Machine& machine, const std::string& remark);

}  // namespace berth::work
