#pragma once

#include <string>
#include <vector>

#include "cuda/driver.hpp"

namespace berth::cuda {

/// A device that runs Berth's kernels.
struct Device {
  CUdevice handle = 0;
  std::string name;
  int capability = 0;  // 10 * major + minor: 53 for a TX1
};

/// What the kernels need: TX1's, the oldest board they were compiled for.
constexpr int kLeastCapability = 53;

/// Every usable device. Throws Error with the reason and the remedy when there is none.
std::vector<Device> find_devices(const Api& api);

/// Index of the device that `wanted` names: by index, or by a part of its name in any case; 0 for the empty string.
/// Throws Error listing the names when none fits.
std::size_t choose_device(const std::vector<Device>& devices, const std::string& wanted);

/// "5.3" for 53.
std::string capability_text(int capability);

}  // namespace berth::cuda
