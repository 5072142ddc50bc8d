#pragma once

#include <array>
#include <vector>

#include "berth/ops.hpp"
#include "spirv_kernels.hpp"
#include "vulkan/gpu.hpp"
#include "vulkan/pipeline_cache.hpp"

namespace berth::vulkan {

/// One form of an operation, ready to be bound.
struct Kernel {
  Handle<VkDescriptorSetLayout> set_layout;  // buffer i is binding i
  Handle<VkPipelineLayout> layout;           // that set; the parameters and the number of groups as push constants
  Handle<VkPipeline> pipeline;
  uint32_t groups = 1;  // of kGroupSize items that a work-group runs
};

/// Every operation's kernels.
class Kernels {
 public:
  /// An operation's, by SpirvForm; without a pipeline where the device has no use for the form.
  using Forms = std::array<Kernel, std::size(kSpirvForms)>;

  /// The one to run with these parameters.
  const Kernel& choose(Op op, const void* params) const;
  void add(Forms forms);

 private:
  std::vector<Forms> forms_;  // by the number of the operation
};

/// Makes them with what the file holds, and keeps there what it did not. Throws Error with the operation that the
/// driver refuses.
Kernels make_kernels(const Gpu& gpu, const PipelineCache& file);

}  // namespace berth::vulkan
