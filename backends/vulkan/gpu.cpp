#include "vulkan/gpu.hpp"

#include <algorithm>
#include <thread>

#include "berth/error.hpp"

namespace berth::vulkan {
namespace {

constexpr VkMemoryPropertyFlags kShared = VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT | VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT |
                                          VK_MEMORY_PROPERTY_HOST_COHERENT_BIT | VK_MEMORY_PROPERTY_HOST_CACHED_BIT;
constexpr uint32_t kNone = ~0u;

/// The first type among the allowed ones that has all of the properties.
uint32_t memory_type(const VkPhysicalDeviceMemoryProperties& memory, uint32_t allowed, VkMemoryPropertyFlags wanted) {
  for (uint32_t i = 0; i < memory.memoryTypeCount; ++i) {
    if ((allowed >> i & 1u) != 0 && (memory.memoryTypes[i].propertyFlags & wanted) == wanted) return i;
  }
  return kNone;
}

Memory make_memory(const Gpu& gpu, std::size_t bytes, VkBufferUsageFlags usage,
                   std::initializer_list<VkMemoryPropertyFlags> preferences, const std::string& what) {
  const Api& api = gpu.api();
  VkBufferCreateInfo info = {};
  info.sType = VK_STRUCTURE_TYPE_BUFFER_CREATE_INFO;
  info.size = (std::max<std::size_t>(bytes, 1) + 3) / 4 * 4;  // not empty, and in whole words for vkCmdFillBuffer
  info.usage = usage | VK_BUFFER_USAGE_TRANSFER_SRC_BIT | VK_BUFFER_USAGE_TRANSFER_DST_BIT;
  VkBuffer buffer = VK_NULL_HANDLE;
  check(api.vkCreateBuffer(gpu.get(), &info, nullptr, &buffer), what);
  Memory made;
  made.buffer = {gpu.get(), buffer, api.vkDestroyBuffer};

  VkMemoryRequirements needs = {};
  api.vkGetBufferMemoryRequirements(gpu.get(), buffer, &needs);
  VkMemoryAllocateInfo allocation = {};
  allocation.sType = VK_STRUCTURE_TYPE_MEMORY_ALLOCATE_INFO;
  allocation.allocationSize = needs.size;
  allocation.memoryTypeIndex = kNone;
  for (const VkMemoryPropertyFlags wanted : preferences) {
    allocation.memoryTypeIndex = memory_type(gpu.memory(), needs.memoryTypeBits, wanted);
    if (allocation.memoryTypeIndex != kNone) break;
  }
  if (allocation.memoryTypeIndex == kNone)
    throw Error("vulkan: " + what + " failed: no such memory; update the driver");
  VkDeviceMemory memory = VK_NULL_HANDLE;
  check(api.vkAllocateMemory(gpu.get(), &allocation, nullptr, &memory), what);
  made.memory = {gpu.get(), memory, api.vkFreeMemory};
  check(api.vkBindBufferMemory(gpu.get(), buffer, memory, 0), what);
  const VkMemoryPropertyFlags has = gpu.memory().memoryTypes[allocation.memoryTypeIndex].propertyFlags;
  const bool map = (usage & VK_BUFFER_USAGE_STORAGE_BUFFER_BIT) == 0 || (gpu.unified() && (has & kShared) == kShared);
  if (map) check(api.vkMapMemory(gpu.get(), memory, 0, VK_WHOLE_SIZE, 0, &made.host), what);
  return made;
}

}  // namespace

Gpu::Gpu(const BackendOptions& options, const Instruments& instruments) : Gpu(instruments) {
  const std::vector<Device> found = find_devices(instance_);
  device_ = found[choose_device(found, options.device)];
  const float priority = 1.0F;
  VkDeviceQueueCreateInfo queue = {};
  queue.sType = VK_STRUCTURE_TYPE_DEVICE_QUEUE_CREATE_INFO;
  queue.queueFamilyIndex = device_.queue_family;
  queue.queueCount = 1;
  queue.pQueuePriorities = &priority;
  VkDeviceCreateInfo info = {};  // no feature and no extension: the kernels need none
  info.sType = VK_STRUCTURE_TYPE_DEVICE_CREATE_INFO;
  info.queueCreateInfoCount = 1;
  info.pQueueCreateInfos = &queue;
  check(api_.vkCreateDevice(device_.physical, &info, nullptr, &logical_), "opening " + device_.name);
  load_device(api_, logical_);
  if (instruments.adapt) instruments.adapt(api_);
  api_.vkGetDeviceQueue(logical_, device_.queue_family, 0, &queue_);
  api_.vkGetPhysicalDeviceMemoryProperties(device_.physical, &memory_);
  if (options.baseline_only) return;
  processor_ = device_.type == VK_PHYSICAL_DEVICE_TYPE_CPU;
  if (processor_) rows_ = std::max(1u, std::thread::hardware_concurrency());
  unified_ = (processor_ || device_.type == VK_PHYSICAL_DEVICE_TYPE_INTEGRATED_GPU) &&
             memory_type(memory_, ~0u, kShared) != kNone;
}

Gpu::~Gpu() {
  if (api_.vkDestroyDevice != nullptr) api_.vkDestroyDevice(logical_, nullptr);
}

VkResult Gpu::submit(const VkSubmitInfo& info, VkFence fence) const {
  const std::lock_guard<std::mutex> lock(queue_mutex_);
  return api_.vkQueueSubmit(queue_, 1, &info, fence);
}

void Gpu::run_once(const std::string& what, const std::function<void(VkCommandBuffer)>& record) const {
  const Handle<VkCommandPool> pool = make_command_pool(VK_COMMAND_POOL_CREATE_TRANSIENT_BIT);
  const Handle<VkFence> fence = make_fence();
  VkCommandBufferAllocateInfo allocation = {};
  allocation.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
  allocation.commandPool = pool.get();
  allocation.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  allocation.commandBufferCount = 1;
  VkCommandBuffer commands = nullptr;
  check(api_.vkAllocateCommandBuffers(logical_, &allocation, &commands), what);
  VkCommandBufferBeginInfo begin = {};
  begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
  begin.flags = VK_COMMAND_BUFFER_USAGE_ONE_TIME_SUBMIT_BIT;
  check(api_.vkBeginCommandBuffer(commands, &begin), what);
  record(commands);
  check(api_.vkEndCommandBuffer(commands), what);
  VkSubmitInfo info = {};
  info.sType = VK_STRUCTURE_TYPE_SUBMIT_INFO;
  info.commandBufferCount = 1;
  info.pCommandBuffers = &commands;
  check(submit(info, fence.get()), what);
  const VkFence handle = fence.get();
  check(api_.vkWaitForFences(logical_, 1, &handle, VK_TRUE, UINT64_MAX), what);
}

Handle<VkCommandPool> Gpu::make_command_pool(VkCommandPoolCreateFlags flags) const {
  VkCommandPoolCreateInfo info = {};
  info.sType = VK_STRUCTURE_TYPE_COMMAND_POOL_CREATE_INFO;
  info.flags = flags;
  info.queueFamilyIndex = device_.queue_family;
  VkCommandPool pool = VK_NULL_HANDLE;
  check(api_.vkCreateCommandPool(logical_, &info, nullptr, &pool), "making a command pool");
  return {logical_, pool, api_.vkDestroyCommandPool};
}

Handle<VkFence> Gpu::make_fence() const {
  VkFenceCreateInfo info = {};
  info.sType = VK_STRUCTURE_TYPE_FENCE_CREATE_INFO;
  VkFence fence = VK_NULL_HANDLE;
  check(api_.vkCreateFence(logical_, &info, nullptr, &fence), "making a fence");
  return {logical_, fence, api_.vkDestroyFence};
}

Memory make_storage(const Gpu& gpu, std::size_t bytes) {
  const std::string what = "a buffer of " + std::to_string(bytes) + " bytes on " + gpu.device().name;
  const VkPhysicalDeviceLimits& limits = gpu.device().properties.limits;
  if (bytes > limits.maxStorageBufferRange) {
    throw Error("vulkan: " + what + " is above its limit of " + std::to_string(limits.maxStorageBufferRange) +
                "; use a smaller image or smaller capacities");
  }
  if (gpu.unified()) {
    return make_memory(gpu, bytes, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, {kShared, VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT},
                       what);
  }
  return make_memory(gpu, bytes, VK_BUFFER_USAGE_STORAGE_BUFFER_BIT, {VK_MEMORY_PROPERTY_DEVICE_LOCAL_BIT, 0}, what);
}

Memory make_staging(const Gpu& gpu, std::size_t bytes) {
  constexpr VkMemoryPropertyFlags kCoherent =
      VK_MEMORY_PROPERTY_HOST_VISIBLE_BIT | VK_MEMORY_PROPERTY_HOST_COHERENT_BIT;
  return make_memory(gpu, bytes, 0, {kCoherent | VK_MEMORY_PROPERTY_HOST_CACHED_BIT, kCoherent},
                     "staging memory of " + std::to_string(bytes) + " bytes for " + gpu.device().name);
}

void barrier(const Api& api, VkCommandBuffer commands, VkPipelineStageFlags before, VkPipelineStageFlags after) {
  const auto accesses = [](VkPipelineStageFlags stages) {
    VkAccessFlags read = 0;
    VkAccessFlags write = 0;
    if ((stages & VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT) != 0) {
      read |= VK_ACCESS_SHADER_READ_BIT;
      write |= VK_ACCESS_SHADER_WRITE_BIT;
    }
    if ((stages & VK_PIPELINE_STAGE_TRANSFER_BIT) != 0) {
      read |= VK_ACCESS_TRANSFER_READ_BIT;
      write |= VK_ACCESS_TRANSFER_WRITE_BIT;
    }
    if ((stages & VK_PIPELINE_STAGE_HOST_BIT) != 0) read |= VK_ACCESS_HOST_READ_BIT;
    return std::make_pair(read, write);
  };
  VkMemoryBarrier memory = {};
  memory.sType = VK_STRUCTURE_TYPE_MEMORY_BARRIER;
  memory.srcAccessMask = accesses(before).second;
  memory.dstAccessMask = accesses(after).first | accesses(after).second;
  api.vkCmdPipelineBarrier(commands, before, after, 0, 1, &memory, 0, nullptr, 0, nullptr);
}

}  // namespace berth::vulkan
