#pragma once

#include <string>
#include <vector>

#include "opencl/api.hpp"

namespace berth::opencl {

/// A device that runs Berth's kernels.
struct Device {
  cl_device_id id = nullptr;
  std::string name;
  std::string vendor;
  std::string driver_version;
  std::string platform_name;
  std::string platform_version;
};

/// Whether a device can run the kernels: what it has of everything they need. Empty strings of Device never matter.
struct Abilities {
  bool available = true;
  bool compiler = true;
  bool little_endian = true;
  std::size_t group_size = 0;   // work-items a group may have
  std::size_t group_width = 0;  // and in its first dimension
  unsigned long long local_bytes = 0;
  int version = 0;  // major * 100 + minor
};

/// Why the kernels cannot run there, empty when they can.
std::string shortcoming(const Abilities& abilities);

/// Every usable device of every platform. Throws Error with the reason and the remedy when there is none.
std::vector<Device> find_devices(const Api& api);

/// Index of the device that `wanted` names: by index, or by a part of its name in any case; 0 for the empty string.
/// Throws Error listing the names when none fits.
std::size_t choose_device(const std::vector<std::string>& names, const std::string& wanted);

}  // namespace berth::opencl
