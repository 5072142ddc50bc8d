#pragma once

#include <functional>
#include <mutex>

#include "berth/backend.hpp"
#include "vulkan/devices.hpp"

namespace berth::vulkan {

/// An open device with one queue, and what everything made on it needs.
class Gpu {
 public:
  /// Opens the device that options.device names. Throws Error when there is no such, naming those there are.
  Gpu(const BackendOptions& options, const Instruments& instruments);
  ~Gpu();
  Gpu(const Gpu&) = delete;
  Gpu& operator=(const Gpu&) = delete;

  const Api& api() const { return api_; }
  VkDevice get() const { return logical_; }
  const Device& device() const { return device_; }
  const VkPhysicalDeviceMemoryProperties& memory() const { return memory_; }
  /// Whether buffers lie in memory that host and device share, cached and coherent.
  bool unified() const { return unified_; }
  /// Whether it is a processor that runs the kernels with its vector units.
  bool processor() const { return processor_; }
  /// Rows of a grid of work-groups: one a thread of a processor, else one. See kernels/prelude/glsl.h.
  uint32_t rows() const { return rows_; }

  /// Submits from any thread.
  VkResult submit(const VkSubmitInfo& info, VkFence fence) const;
  /// Records commands, runs them and waits: while setting up. Throws Error.
  void run_once(const std::string& what, const std::function<void(VkCommandBuffer)>& record) const;

  Handle<VkCommandPool> make_command_pool(VkCommandPoolCreateFlags flags) const;
  Handle<VkFence> make_fence() const;

 private:
  explicit Gpu(const Instruments& instruments) : instance_(instruments), api_(instance_.api()) {}

  Instance instance_;
  Api api_;
  Device device_;
  VkDevice logical_ = nullptr;
  VkQueue queue_ = nullptr;
  mutable std::mutex queue_mutex_;
  VkPhysicalDeviceMemoryProperties memory_ = {};
  bool unified_ = false;
  bool processor_ = false;
  uint32_t rows_ = 1;
};

/// A buffer with memory of its own.
struct Memory {
  Handle<VkDeviceMemory> memory;
  Handle<VkBuffer> buffer;
  void* host = nullptr;  // where the host sees it, null where it does not
};

/// Not zeroed. Throws Error when the device has no room.
Memory make_storage(const Gpu& gpu, std::size_t bytes);
/// Memory for copies, which the host sees without flushes; cached where there is such.
Memory make_staging(const Gpu& gpu, std::size_t bytes);

/// Everything before is visible to everything after, between the stages named.
void barrier(const Api& api, VkCommandBuffer commands, VkPipelineStageFlags before, VkPipelineStageFlags after);

}  // namespace berth::vulkan
