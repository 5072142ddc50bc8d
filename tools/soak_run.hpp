#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <map>
#include <string>
#include <vector>

#include "soak_backends.hpp"
#include "soak_check.hpp"
#include "soak_scenario.hpp"

namespace berth::cli {

/// What a scenario, or all so far, came to.
struct SoakTally {
  u64 scenarios = 0;
  /// With a result; with a result that was compared with a plain run's; that the pipeline dropped for newer ones.
  u64 frames = 0, compared = 0, dropped = 0;
  u64 poses = 0;
  /// Camera faults that began, by kind; and what the camera's source counted.
  std::array<u64, kCameraFaults> camera_faults = {};
  SourceHealth camera;
  u64 devices_lost = 0, devices_hung = 0, failed_over = 0, returned = 0, devices_stalled = 0;
  u64 threads_stopped = 0;
  u64 recordings = 0, replayed = 0, disks_full = 0, recovered = 0;
  /// Scenarios of each configuration that there is: "tracked", "on simd", …
  std::map<std::string, u64> kinds;

  void add(const SoakTally& other);
};

/// One scenario's.
struct SoakOutcome {
  SoakTally tally;
  std::vector<SoakViolation> violations;
  /// SIGINT came: it says nothing.
  bool interrupted = false;
};

/// Alters what a picture is said to show before anything is checked by it: for tests, which plant violations.
using AlterTruth = std::function<void(std::vector<TruthMarker>&)>;

/// Renders a scenario, runs it as `berth run` does, and holds every frame and the whole to what must be so.
SoakOutcome run_scenario(const SoakScenario& scenario, const SoakBackends& backends, const AlterTruth& alter = {});

}  // namespace berth::cli
