#pragma once

#include <atomic>
#include <vector>

#include "vulkan/kernels.hpp"

namespace berth::vulkan {

class VkStorage final : public Buffer {
 public:
  VkStorage(std::size_t bytes, const Gpu& gpu, Memory memory) : Buffer(bytes), gpu_(gpu), memory_(std::move(memory)) {}
  void* host() override { return memory_.host; }
  const Gpu& gpu() const { return gpu_; }
  VkBuffer handle() const { return memory_.buffer.get(); }

 private:
  const Gpu& gpu_;
  Memory memory_;
};

/// Steps as one command buffer: descriptor sets and commands are written here, once. A step that needs nothing of
/// another runs beside it; between those that must follow each other lies one barrier for all of them.
class VkPlan final : public Plan {
 public:
  /// Throws Error for a step whose buffers or parameters are not as the operation wants them.
  VkPlan(const Gpu& gpu, const Kernels& kernels, const std::vector<Step>& steps);

  /// May be pending any number of times at once.
  VkCommandBuffer commands() const { return commands_; }
  int dispatches() const { return static_cast<int>(launches_.size()); }
  /// Between dispatches; one before and one after them come on top.
  int barriers() const { return barriers_; }
  /// Time of each step, alone on the device, ns; 0 for a step without items. Records and waits: not for every frame.
  std::vector<std::int64_t> time_steps() const;

 private:
  struct Launch {
    const Kernel* kernel;
    VkDescriptorSet set;
    std::vector<std::byte> params;
    uint32_t groups;
    std::size_t step;
    int level;  // after how many barriers at least
  };
  void add(const Kernel& kernel, const Step& step, std::size_t index);
  void make_sets(const std::vector<Step>& steps);
  void find_levels(const std::vector<Step>& steps);
  void record();
  void dispatch(VkCommandBuffer commands, const Launch& launch) const;

  const Gpu& gpu_;
  std::size_t steps_;
  Handle<VkDescriptorPool> sets_;
  Handle<VkCommandPool> pool_;
  VkCommandBuffer commands_ = nullptr;
  std::vector<Launch> launches_;  // by level
  int barriers_ = 0;
};

}  // namespace berth::vulkan
