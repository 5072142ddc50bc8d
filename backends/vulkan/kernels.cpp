#include "vulkan/kernels.hpp"

namespace berth::vulkan {
namespace {

Handle<VkPipelineCache> make_cache(const Gpu& gpu, const std::vector<unsigned char>& data) {
  VkPipelineCacheCreateInfo info = {};
  info.sType = VK_STRUCTURE_TYPE_PIPELINE_CACHE_CREATE_INFO;
  info.initialDataSize = data.size();
  info.pInitialData = data.data();
  VkPipelineCache cache = VK_NULL_HANDLE;
  check(gpu.api().vkCreatePipelineCache(gpu.get(), &info, nullptr, &cache), "making the pipeline cache");
  return {gpu.get(), cache, gpu.api().vkDestroyPipelineCache};
}

/// What the driver wants kept; empty when it does not say.
std::vector<unsigned char> data_of(const Gpu& gpu, VkPipelineCache cache) {
  std::size_t size = 0;
  if (gpu.api().vkGetPipelineCacheData(gpu.get(), cache, &size, nullptr) != VK_SUCCESS) return {};
  std::vector<unsigned char> data(size);
  if (gpu.api().vkGetPipelineCacheData(gpu.get(), cache, &size, data.data()) != VK_SUCCESS) return {};
  data.resize(size);
  return data;
}

Handle<VkDescriptorSetLayout> make_set_layout(const Gpu& gpu, Op op) {
  std::vector<VkDescriptorSetLayoutBinding> bindings(args_of(op).size());
  for (uint32_t i = 0; i < bindings.size(); ++i) {
    bindings[i].binding = i;
    bindings[i].descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    bindings[i].descriptorCount = 1;
    bindings[i].stageFlags = VK_SHADER_STAGE_COMPUTE_BIT;
  }
  VkDescriptorSetLayoutCreateInfo info = {};
  info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_LAYOUT_CREATE_INFO;
  info.bindingCount = static_cast<uint32_t>(bindings.size());
  info.pBindings = bindings.data();
  VkDescriptorSetLayout layout = VK_NULL_HANDLE;
  check(gpu.api().vkCreateDescriptorSetLayout(gpu.get(), &info, nullptr, &layout),
        std::string("describing the buffers of ") + name_of(op));
  return {gpu.get(), layout, gpu.api().vkDestroyDescriptorSetLayout};
}

Handle<VkPipelineLayout> make_layout(const Gpu& gpu, Op op, VkDescriptorSetLayout set_layout) {
  VkPushConstantRange params = {};
  params.stageFlags = VK_SHADER_STAGE_COMPUTE_BIT;
  params.size = static_cast<uint32_t>(param_bytes(op) + sizeof(Kernel::groups));
  VkPipelineLayoutCreateInfo info = {};
  info.sType = VK_STRUCTURE_TYPE_PIPELINE_LAYOUT_CREATE_INFO;
  info.setLayoutCount = 1;
  info.pSetLayouts = &set_layout;
  info.pushConstantRangeCount = 1;
  info.pPushConstantRanges = &params;
  VkPipelineLayout layout = VK_NULL_HANDLE;
  check(gpu.api().vkCreatePipelineLayout(gpu.get(), &info, nullptr, &layout),
        std::string("describing the parameters of ") + name_of(op));
  return {gpu.get(), layout, gpu.api().vkDestroyPipelineLayout};
}

Handle<VkPipeline> make_pipeline(const Gpu& gpu, Op op, const SpirvKernel& kernel, VkPipelineLayout layout,
                                 VkPipelineCache cache) {
  const std::string what = std::string("building the kernel ") + name_of(op) + " for " + gpu.device().name;
  VkShaderModuleCreateInfo module_info = {};
  module_info.sType = VK_STRUCTURE_TYPE_SHADER_MODULE_CREATE_INFO;
  module_info.codeSize = kernel.bytes;
  module_info.pCode = kernel.words;
  VkShaderModule module_object = VK_NULL_HANDLE;
  check(gpu.api().vkCreateShaderModule(gpu.get(), &module_info, nullptr, &module_object), what);
  const Handle<VkShaderModule> module(gpu.get(), module_object, gpu.api().vkDestroyShaderModule);
  VkComputePipelineCreateInfo info = {};
  info.sType = VK_STRUCTURE_TYPE_COMPUTE_PIPELINE_CREATE_INFO;
  info.stage.sType = VK_STRUCTURE_TYPE_PIPELINE_SHADER_STAGE_CREATE_INFO;
  info.stage.stage = VK_SHADER_STAGE_COMPUTE_BIT;
  info.stage.module = module.get();
  info.stage.pName = "main";
  info.layout = layout;
  VkPipeline pipeline = VK_NULL_HANDLE;
  check(gpu.api().vkCreateComputePipelines(gpu.get(), cache, 1, &info, nullptr, &pipeline), what);
  return {gpu.get(), pipeline, gpu.api().vkDestroyPipeline};
}

Kernel make_kernel(const Gpu& gpu, Op op, const SpirvKernel& spirv, VkPipelineCache cache) {
  Kernel kernel;
  kernel.groups = static_cast<uint32_t>(spirv.groups);
  kernel.set_layout = make_set_layout(gpu, op);
  kernel.layout = make_layout(gpu, op, kernel.set_layout.get());
  kernel.pipeline = make_pipeline(gpu, op, spirv, kernel.layout.get(), cache);
  return kernel;
}

}  // namespace

const Kernel& Kernels::choose(Op op, const void* params) const {
  const Forms& forms = forms_[static_cast<std::size_t>(op)];
  for (const SpirvForm form : {SpirvForm::lanes, SpirvForm::stride}) {
    const Kernel& kernel = forms[static_cast<std::size_t>(form)];
    if (kernel.pipeline.get() != VK_NULL_HANDLE && spirv_kernel(op, form).applies(params)) return kernel;
  }
  return forms[static_cast<std::size_t>(SpirvForm::any)];
}

void Kernels::add(Forms forms) { forms_.push_back(std::move(forms)); }

Kernels make_kernels(const Gpu& gpu, const PipelineCache& file) {
  const std::vector<unsigned char> kept = file.load();
  const Handle<VkPipelineCache> cache = make_cache(gpu, kept);
  Kernels kernels;
  for (const Op op : all_ops()) {
    Kernels::Forms forms;
    for (const SpirvForm form : kSpirvForms) {
      const SpirvKernel& spirv = spirv_kernel(op, form);
      if (spirv.words == nullptr || (form != SpirvForm::any && !gpu.processor())) continue;
      forms[static_cast<std::size_t>(form)] = make_kernel(gpu, op, spirv, cache.get());
    }
    kernels.add(std::move(forms));
  }
  if (!file.path().empty()) {
    const std::vector<unsigned char> data = data_of(gpu, cache.get());
    if (data != kept) file.store(data);
  }
  return kernels;
}

}  // namespace berth::vulkan
