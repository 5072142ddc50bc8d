#pragma once

#include <ostream>
#include <string>
#include <vector>

#include "frame_json.hpp"
#include "soak_run.hpp"

namespace berth::cli {

/// What the process takes, bytes.
struct SoakMemory {
  u64 resident = 0;
  /// Handed out by malloc and not given back; 0 where the C library does not say.
  u64 allocated = 0;
};
SoakMemory memory_now();

/// Scenarios of a process until its memory counts as settled: caches are filled, every backend has been used.
constexpr u64 kSettled = 40;
/// By how much memory may then exceed the most that was seen until then, after any scenario.
constexpr u64 kMostResidentGrowth = 64'000'000, kMostAllocatedGrowth = 16'000'000;

/// What a soak has come to so far: a file that it goes on from, and a report for people.
struct SoakReport {
  u64 seed = 1;
  /// The scenario to come.
  u64 next = 0;
  /// Spent on scenarios, in all runs.
  double seconds = 0;
  /// Runs of the command, the first among them.
  u64 runs = 0;
  SoakTally tally;
  /// The first of them; all are counted.
  std::vector<SoakViolation> violations;
  u64 violation_count = 0;
  /// Since the last start: scenarios, the most memory after one until it was settled, and after all since then.
  u64 since_start = 0;
  SoakMemory settled, most;

  /// Takes a scenario that took so long. Memory that grows is a violation.
  void add(const SoakOutcome& outcome, double seconds_taken, const SoakMemory& memory);
  /// A process begins: its memory is another.
  void begin_run();
};

/// The command that repeats a violation's scenario.
std::string command_of(const SoakReport& report, const SoakViolation& violation);

Json to_json(const SoakReport& report);
/// Throws Error on a file that is none of berth soak's, or of another seed or version.
SoakReport read_soak_report(const std::string& file, u64 seed);

/// Markdown.
void print(std::ostream& out, const SoakReport& report);

}  // namespace berth::cli
