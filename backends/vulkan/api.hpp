#pragma once

#include <vulkan/vulkan_core.h>

#include <string>
#include <utility>

namespace berth::vulkan {

/// The functions of Vulkan 1.1 that Berth calls: of the loader, of an instance, of a device.
#define BERTH_VULKAN_LOADER_FUNCTIONS(X) \
  X(vkCreateInstance)                    \
  X(vkEnumerateInstanceVersion)          \
  X(vkEnumerateInstanceLayerProperties)

#define BERTH_VULKAN_INSTANCE_FUNCTIONS(X)    \
  X(vkDestroyInstance)                        \
  X(vkEnumeratePhysicalDevices)               \
  X(vkGetPhysicalDeviceProperties2)           \
  X(vkGetPhysicalDeviceMemoryProperties)      \
  X(vkGetPhysicalDeviceQueueFamilyProperties) \
  X(vkEnumerateDeviceExtensionProperties)     \
  X(vkCreateDevice)                           \
  X(vkGetDeviceProcAddr)

#define BERTH_VULKAN_DEVICE_FUNCTIONS(X) \
  X(vkDestroyDevice)                     \
  X(vkGetDeviceQueue)                    \
  X(vkDeviceWaitIdle)                    \
  X(vkCreateBuffer)                      \
  X(vkDestroyBuffer)                     \
  X(vkGetBufferMemoryRequirements)       \
  X(vkAllocateMemory)                    \
  X(vkFreeMemory)                        \
  X(vkBindBufferMemory)                  \
  X(vkMapMemory)                         \
  X(vkCreateShaderModule)                \
  X(vkDestroyShaderModule)               \
  X(vkCreateDescriptorSetLayout)         \
  X(vkDestroyDescriptorSetLayout)        \
  X(vkCreatePipelineLayout)              \
  X(vkDestroyPipelineLayout)             \
  X(vkCreatePipelineCache)               \
  X(vkDestroyPipelineCache)              \
  X(vkGetPipelineCacheData)              \
  X(vkCreateComputePipelines)            \
  X(vkDestroyPipeline)                   \
  X(vkCreateDescriptorPool)              \
  X(vkDestroyDescriptorPool)             \
  X(vkAllocateDescriptorSets)            \
  X(vkUpdateDescriptorSets)              \
  X(vkCreateCommandPool)                 \
  X(vkDestroyCommandPool)                \
  X(vkAllocateCommandBuffers)            \
  X(vkBeginCommandBuffer)                \
  X(vkEndCommandBuffer)                  \
  X(vkCmdBindPipeline)                   \
  X(vkCmdBindDescriptorSets)             \
  X(vkCmdPushConstants)                  \
  X(vkCmdDispatch)                       \
  X(vkCmdPipelineBarrier)                \
  X(vkCmdCopyBuffer)                     \
  X(vkCmdFillBuffer)                     \
  X(vkCreateQueryPool)                   \
  X(vkDestroyQueryPool)                  \
  X(vkCmdResetQueryPool)                 \
  X(vkCmdWriteTimestamp)                 \
  X(vkGetQueryPoolResults)               \
  X(vkCreateFence)                       \
  X(vkDestroyFence)                      \
  X(vkResetFences)                       \
  X(vkWaitForFences)                     \
  X(vkQueueSubmit)

/// Pointers into the Vulkan loader, which stays open until the process ends: drivers have threads of their own.
/// Those of an instance and of a device are null until load_instance and load_device.
struct Api {
  PFN_vkGetInstanceProcAddr vkGetInstanceProcAddr = nullptr;
#define X(function) PFN_##function function = nullptr;
  BERTH_VULKAN_LOADER_FUNCTIONS(X)
  BERTH_VULKAN_INSTANCE_FUNCTIONS(X)
  BERTH_VULKAN_DEVICE_FUNCTIONS(X)
#undef X
};

/// Opens $BERTH_VULKAN_LIBRARY, or libvulkan.so.1, or libvulkan.so. Throws Error with the linker's words and the
/// remedy.
Api load_api();
/// Fill in the instance's and the device's functions. Throw Error naming one that is missing.
void load_instance(Api& api, VkInstance instance);
void load_device(Api& api, VkDevice device);

/// "-4 VK_ERROR_DEVICE_LOST"
std::string describe_result(VkResult result);

/// Throws Error("vulkan: WHAT failed (RESULT); REMEDY") for every result below zero.
void check(VkResult result, const std::string& what);

/// Owns one object of a device.
template <class T>
class Handle {
 public:
  using Destroy = void(VKAPI_PTR*)(VkDevice, T, const VkAllocationCallbacks*);
  Handle() = default;
  Handle(VkDevice device, T object, Destroy destroy) : device_(device), object_(object), destroy_(destroy) {}
  Handle(Handle&& other) noexcept
      : device_(other.device_), object_(std::exchange(other.object_, T{})), destroy_(other.destroy_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(device_, other.device_);
    std::swap(object_, other.object_);
    std::swap(destroy_, other.destroy_);
    return *this;
  }
  ~Handle() {
    if (object_ != T{}) destroy_(device_, object_, nullptr);
  }
  T get() const { return object_; }

 private:
  VkDevice device_ = nullptr;
  T object_{};
  Destroy destroy_ = nullptr;
};

}  // namespace berth::vulkan
