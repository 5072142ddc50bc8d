#pragma once

#include <vector>

#include "berth/ops.hpp"
#include "vulkan/gpu.hpp"
#include "vulkan/pipeline_cache.hpp"

namespace berth::vulkan {

/// One form of an operation, ready to be bound.
struct Kernel {
  Handle<VkDescriptorSetLayout> set_layout;  // buffer i is binding i
  Handle<VkPipelineLayout> layout;           // that set, and the parameters as push constants
  Handle<VkPipeline> pipeline;
  uint32_t groups = 1;  // of kGroupSize items that a work-group runs; if several, how many there are follows the params
};

/// Every operation's kernels.
class Kernels {
 public:
  /// The one to run with these parameters.
  const Kernel& choose(Op op, const void* params) const;
  void add(Kernel any, Kernel lanes);

 private:
  struct Forms {
    Kernel any;
    Kernel lanes;  // without a pipeline where there is none
  };
  std::vector<Forms> forms_;  // by the number of the operation
};

/// Makes them with what the file holds, and keeps there what it did not. Throws Error with the operation that the
/// driver refuses.
Kernels make_kernels(const Gpu& gpu, const PipelineCache& file);

}  // namespace berth::vulkan
