#pragma once

#include <string>
#include <vector>

#include "vulkan/instance.hpp"

namespace berth::vulkan {

/// A device that runs Berth's kernels.
struct Device {
  VkPhysicalDevice physical = nullptr;
  std::string name;
  std::string driver;  // "llvmpipe, Mesa 22.3.6 (LLVM 15.0.6)"
  VkPhysicalDeviceType type = VK_PHYSICAL_DEVICE_TYPE_OTHER;
  uint32_t queue_family = 0;    // the first one that computes
  uint32_t timestamp_bits = 0;  // that mean something in a timestamp of that family; 0 for no timestamps
  VkPhysicalDeviceProperties properties = {};
};

/// What a device has of everything the kernels need.
struct Abilities {
  uint32_t version = 0;       // of its Vulkan
  bool computes = false;      // has a queue that does
  uint32_t group_items = 0;   // work-items a group may have
  uint32_t group_width = 0;   // and in its first dimension
  uint32_t shared_bytes = 0;  // a group may share
  uint32_t buffers = 0;       // a kernel may use
};

/// Why the kernels cannot run there, empty when they can.
std::string shortcoming(const Abilities& abilities);

/// The usable devices: discrete GPUs, integrated ones, virtual ones, CPUs, others; in the loader's order among equals.
/// Throws Error with the reason and the remedy when there is none.
std::vector<Device> find_devices(const Instance& instance);

/// Index of the device that `wanted` names: by index, or by a part of its name in any case; 0 for the empty string.
/// Throws Error listing the names when none fits.
std::size_t choose_device(const std::vector<Device>& devices, const std::string& wanted);

}  // namespace berth::vulkan
