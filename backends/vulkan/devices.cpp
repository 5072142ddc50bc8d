#include "vulkan/devices.hpp"

#include <algorithm>
#include <cctype>
#include <cstdlib>
#include <cstring>

#include "berth/error.hpp"
#include "berth/ops.hpp"

namespace berth::vulkan {
namespace {

/// Shared memory that a kernel may count on: Vulkan's minimum, which the kernels keep to.
constexpr uint32_t kSharedBytes = 16384;

/// The most buffers an operation uses. Vulkan promises four; every driver known has more.
uint32_t most_buffers() {
  std::size_t most = 0;
  for (const Op op : all_ops()) most = std::max(most, args_of(op).size());
  return static_cast<uint32_t>(most);
}

std::string version_text(uint32_t version) {
  return std::to_string(VK_API_VERSION_MAJOR(version)) + "." + std::to_string(VK_API_VERSION_MINOR(version));
}

bool has_extension(const Api& api, VkPhysicalDevice device, const char* wanted) {
  uint32_t count = 0;
  if (api.vkEnumerateDeviceExtensionProperties(device, nullptr, &count, nullptr) < 0) return false;
  std::vector<VkExtensionProperties> extensions(count);
  if (api.vkEnumerateDeviceExtensionProperties(device, nullptr, &count, extensions.data()) < 0) return false;
  return std::any_of(extensions.begin(), extensions.begin() + count, [&](const VkExtensionProperties& extension) {
    return std::strcmp(extension.extensionName, wanted) == 0;
  });
}

std::string driver_of(const Api& api, VkPhysicalDevice device, const VkPhysicalDeviceProperties& properties) {
  if (properties.apiVersion < VK_API_VERSION_1_2 &&
      !has_extension(api, device, VK_KHR_DRIVER_PROPERTIES_EXTENSION_NAME)) {
    return "driver " + std::to_string(properties.driverVersion);
  }
  VkPhysicalDeviceDriverProperties driver = {};
  driver.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_DRIVER_PROPERTIES;
  VkPhysicalDeviceProperties2 all = {};
  all.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
  all.pNext = &driver;
  api.vkGetPhysicalDeviceProperties2(device, &all);
  return std::string(driver.driverName) + ", " + driver.driverInfo;
}

/// A device, and what it lacks.
Device describe(const Api& api, VkPhysicalDevice physical, std::string& lacks) {
  VkPhysicalDeviceProperties2 all = {};
  all.sType = VK_STRUCTURE_TYPE_PHYSICAL_DEVICE_PROPERTIES_2;
  api.vkGetPhysicalDeviceProperties2(physical, &all);
  Device device;
  device.physical = physical;
  device.properties = all.properties;
  device.name = device.properties.deviceName;
  device.type = device.properties.deviceType;
  const VkPhysicalDeviceLimits& limits = device.properties.limits;
  Abilities abilities;
  abilities.version = device.properties.apiVersion;
  abilities.group_items = limits.maxComputeWorkGroupInvocations;
  abilities.group_width = limits.maxComputeWorkGroupSize[0];
  abilities.shared_bytes = limits.maxComputeSharedMemorySize;
  abilities.buffers = std::min(limits.maxPerStageDescriptorStorageBuffers, limits.maxDescriptorSetStorageBuffers);
  uint32_t count = 0;
  api.vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, nullptr);
  std::vector<VkQueueFamilyProperties> families(count);
  api.vkGetPhysicalDeviceQueueFamilyProperties(physical, &count, families.data());
  for (uint32_t i = 0; i < count && !abilities.computes; ++i) {
    if (families[i].queueCount == 0 || (families[i].queueFlags & VK_QUEUE_COMPUTE_BIT) == 0) continue;
    abilities.computes = true;
    device.queue_family = i;
    device.timestamp_bits = families[i].timestampValidBits;
  }
  lacks = shortcoming(abilities);
  if (lacks.empty()) device.driver = driver_of(api, physical, device.properties);
  return device;
}

int rank(VkPhysicalDeviceType type) {
  switch (type) {
    case VK_PHYSICAL_DEVICE_TYPE_DISCRETE_GPU:
      return 0;
    case VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU:
      return 1;
    case VK_PHYSICAL_DEVICE_TYPE_VIRTUAL_GPU:
      return 2;
    case VK_PHYSICAL_DEVICE_TYPE_CPU:
      return 3;
    default:
      return 4;
  }
}

std::string lower(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(),
                 [](char c) { return static_cast<char>(std::tolower(static_cast<unsigned char>(c))); });
  return text;
}

}  // namespace

std::string shortcoming(const Abilities& abilities) {
  if (abilities.version < VK_API_VERSION_1_1) return "it has Vulkan " + version_text(abilities.version) + ", not 1.1";
  if (!abilities.computes) return "it has no compute queue";
  const uint32_t group = std::min(abilities.group_items, abilities.group_width);
  if (group < static_cast<uint32_t>(kGroupSize)) {
    return "its work-groups have at most " + std::to_string(group) + " work-items, not " + std::to_string(kGroupSize);
  }
  if (abilities.shared_bytes < kSharedBytes) {
    return "its work-groups share " + std::to_string(abilities.shared_bytes) + " bytes, not " +
           std::to_string(kSharedBytes);
  }
  if (abilities.buffers < most_buffers()) {
    return "its kernels use at most " + std::to_string(abilities.buffers) + " buffers, not " +
           std::to_string(most_buffers());
  }
  return "";
}

std::vector<Device> find_devices(const Instance& instance) {
  const Api& api = instance.api();
  uint32_t count = 0;
  check(api.vkEnumeratePhysicalDevices(instance.get(), &count, nullptr), "listing the devices");
  std::vector<VkPhysicalDevice> all(count);
  check(api.vkEnumeratePhysicalDevices(instance.get(), &count, all.data()), "listing the devices");
  std::vector<Device> found;
  std::string unfit;
  for (VkPhysicalDevice physical : all) {
    std::string lacks;
    Device device = describe(api, physical, lacks);
    if (lacks.empty()) {
      found.push_back(std::move(device));
    } else {
      unfit += (unfit.empty() ? "" : "; ") + device.name + ": " + lacks;
    }
  }
  if (found.empty()) {
    const std::string remedy = "; apt install mesa-vulkan-drivers, which also runs on the CPU";
    throw Error(unfit.empty() ? "vulkan: the drivers find no device" + remedy
                              : "vulkan: no device can run the kernels (" + unfit + ")" + remedy);
  }
  std::stable_sort(found.begin(), found.end(),
                   [](const Device& a, const Device& b) { return rank(a.type) < rank(b.type); });
  return found;
}

std::size_t choose_device(const std::vector<Device>& devices, const std::string& wanted) {
  if (wanted.empty()) return 0;
  if (wanted.size() < 6 && wanted.find_first_not_of("0123456789") == std::string::npos) {
    const std::size_t index = static_cast<std::size_t>(std::atoi(wanted.c_str()));
    if (index < devices.size()) return index;
  }
  std::string list;
  for (std::size_t i = 0; i < devices.size(); ++i) {
    if (lower(devices[i].name).find(lower(wanted)) != std::string::npos) return i;
    list += (i == 0 ? "" : ", ") + std::to_string(i) + ": " + devices[i].name;
  }
  throw Error("vulkan: no device '" + wanted + "'; give an index or a part of a name of " + list);
}

}  // namespace berth::vulkan
