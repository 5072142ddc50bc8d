#include "soak_tally.hpp"

namespace berth::cli {

void SoakTally::add(const SoakTally& other) {
  for (const auto& [name, count] : kSoakCounts) this->*count += other.*count;
  for (const auto& [name, count] : kSourceCounts) camera.*count += other.camera.*count;
  for (std::size_t i = 0; i < kCameraFaults; ++i) camera_faults[i] += other.camera_faults[i];
  for (const auto& [kind, count] : other.kinds) kinds[kind] += count;
}

}  // namespace berth::cli
