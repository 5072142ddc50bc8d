#pragma once

#include <array>
#include <map>
#include <string>
#include <utility>

#include "berth/source.hpp"
#include "verify/faulty_camera.hpp"

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

/// Every count, by its name in a soak's state: what is added up, written and read.
inline constexpr std::array<std::pair<const char*, u64 SoakTally::*>, 15> kSoakCounts = {{
    {"scenarios", &SoakTally::scenarios},
    {"frames", &SoakTally::frames},
    {"compared", &SoakTally::compared},
    {"dropped", &SoakTally::dropped},
    {"poses", &SoakTally::poses},
    {"devices_lost", &SoakTally::devices_lost},
    {"devices_hung", &SoakTally::devices_hung},
    {"failed_over", &SoakTally::failed_over},
    {"returned", &SoakTally::returned},
    {"devices_stalled", &SoakTally::devices_stalled},
    {"threads_stopped", &SoakTally::threads_stopped},
    {"recordings", &SoakTally::recordings},
    {"replayed", &SoakTally::replayed},
    {"disks_full", &SoakTally::disks_full},
    {"recovered", &SoakTally::recovered},
}};
inline constexpr std::array<std::pair<const char*, u64 SourceHealth::*>, 6> kSourceCounts = {{
    {"lost", &SourceHealth::lost},
    {"incomplete", &SourceHealth::incomplete},
    {"skipped", &SourceHealth::skipped},
    {"repeated", &SourceHealth::repeated},
    {"misdated", &SourceHealth::misdated},
    {"reopened", &SourceHealth::reopened},
}};

}  // namespace berth::cli
