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
#include "soak_tally.hpp"

namespace berth::cli {

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
