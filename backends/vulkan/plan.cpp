#include "vulkan/plan.hpp"

#include <algorithm>
#include <map>

#include "berth/error.hpp"

namespace berth::vulkan {
namespace {

VkBuffer handle_of(Buffer* buffer) { return static_cast<VkStorage*>(buffer)->handle(); }

void check_step(const Gpu& gpu, const Step& step) {
  const std::string what = std::string("an argument of ") + name_of(step.op);
  if (step.buffers.size() != args_of(step.op).size() || step.params.size() != param_bytes(step.op)) {
    throw Error("vulkan: " + what + " is missing; make steps with make_step");
  }
  for (Buffer* buffer : step.buffers) {
    const auto* mine = dynamic_cast<const VkStorage*>(buffer);
    if (mine == nullptr || &mine->gpu() != &gpu) throw Error("vulkan: " + what + " is not a buffer of this backend");
  }
  const uint32_t most = gpu.device().properties.limits.maxComputeWorkGroupCount[0];
  if (static_cast<uint32_t>((step.items - 1) / kGroupSize) >= most) {
    throw Error("vulkan: " + gpu.device().name + " runs at most " + std::to_string(most) + " work-groups; " +
                name_of(step.op) + " has " + std::to_string(step.items) + " work-items: use a smaller image");
  }
}

}  // namespace

VkPlan::VkPlan(const Gpu& gpu, const Kernels& kernels, const std::vector<Step>& steps)
    : gpu_(gpu), steps_(steps.size()) {
  for (std::size_t i = 0; i < steps.size(); ++i) {
    if (steps[i].items <= 0) continue;
    check_step(gpu, steps[i]);
    const uint32_t groups = static_cast<uint32_t>((steps[i].items - 1) / kGroupSize + 1);
    launches_.push_back(
        {&kernels.choose(steps[i].op, steps[i].params.data()), VK_NULL_HANDLE, steps[i].params, groups, i, 0});
  }
  if (!launches_.empty()) make_sets(steps);
  find_levels(steps);
  record();
}

void VkPlan::make_sets(const std::vector<Step>& steps) {
  const Api& api = gpu_.api();
  VkDescriptorPoolSize size = {VK_DESCRIPTOR_TYPE_STORAGE_BUFFER, 0};
  for (const Launch& launch : launches_)
    size.descriptorCount += static_cast<uint32_t>(steps[launch.step].buffers.size());
  VkDescriptorPoolCreateInfo info = {};
  info.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_POOL_CREATE_INFO;
  info.maxSets = static_cast<uint32_t>(launches_.size());
  info.poolSizeCount = 1;
  info.pPoolSizes = &size;
  VkDescriptorPool pool = VK_NULL_HANDLE;
  check(api.vkCreateDescriptorPool(gpu_.get(), &info, nullptr, &pool), "making a plan's descriptors");
  sets_ = {gpu_.get(), pool, api.vkDestroyDescriptorPool};
  for (Launch& launch : launches_) {
    const VkDescriptorSetLayout layout = launch.kernel->set_layout.get();
    VkDescriptorSetAllocateInfo allocation = {};
    allocation.sType = VK_STRUCTURE_TYPE_DESCRIPTOR_SET_ALLOCATE_INFO;
    allocation.descriptorPool = pool;
    allocation.descriptorSetCount = 1;
    allocation.pSetLayouts = &layout;
    check(api.vkAllocateDescriptorSets(gpu_.get(), &allocation, &launch.set), "making a plan's descriptors");
    const std::vector<Buffer*>& buffers = steps[launch.step].buffers;
    std::vector<VkDescriptorBufferInfo> infos;
    for (Buffer* buffer : buffers) infos.push_back({handle_of(buffer), 0, VK_WHOLE_SIZE});
    VkWriteDescriptorSet write = {};
    write.sType = VK_STRUCTURE_TYPE_WRITE_DESCRIPTOR_SET;
    write.dstSet = launch.set;
    write.descriptorCount = static_cast<uint32_t>(infos.size());
    write.descriptorType = VK_DESCRIPTOR_TYPE_STORAGE_BUFFER;
    write.pBufferInfo = infos.data();
    api.vkUpdateDescriptorSets(gpu_.get(), 1, &write, 0, nullptr);
  }
}

// A step comes after the last write of what it reads or writes, and after the last read of what it writes.
void VkPlan::find_levels(const std::vector<Step>& steps) {
  struct Uses {
    int written = -1;
    int read = -1;
  };
  std::map<Buffer*, Uses> uses;
  int deepest = 0;
  for (Launch& launch : launches_) {
    const Step& step = steps[launch.step];
    const std::vector<Arg>& args = args_of(step.op);
    for (std::size_t i = 0; i < args.size(); ++i) {
      const Uses& before = uses[step.buffers[i]];
      launch.level = std::max(launch.level, before.written + 1);
      if (!args[i].read_only) launch.level = std::max(launch.level, before.read + 1);
    }
    for (std::size_t i = 0; i < args.size(); ++i) {
      Uses& now = uses[step.buffers[i]];
      int& last = args[i].read_only ? now.read : now.written;
      last = std::max(last, launch.level);
    }
    deepest = std::max(deepest, launch.level);
  }
  barriers_ = deepest;
  std::stable_sort(launches_.begin(), launches_.end(),
                   [](const Launch& a, const Launch& b) { return a.level < b.level; });
}

void VkPlan::dispatch(VkCommandBuffer commands, const Launch& launch) const {
  const Api& api = gpu_.api();
  const VkPipelineLayout layout = launch.kernel->layout.get();
  api.vkCmdBindPipeline(commands, VK_PIPELINE_BIND_POINT_COMPUTE, launch.kernel->pipeline.get());
  api.vkCmdBindDescriptorSets(commands, VK_PIPELINE_BIND_POINT_COMPUTE, layout, 0, 1, &launch.set, 0, nullptr);
  api.vkCmdPushConstants(commands, layout, VK_SHADER_STAGE_COMPUTE_BIT, 0, static_cast<uint32_t>(launch.params.size()),
                         launch.params.data());
  api.vkCmdPushConstants(commands, layout, VK_SHADER_STAGE_COMPUTE_BIT, static_cast<uint32_t>(launch.params.size()),
                         sizeof launch.groups, &launch.groups);
  const uint32_t work_groups = (launch.groups - 1) / launch.kernel->groups + 1;
  const uint32_t rows = std::min(gpu_.rows(), work_groups);
  api.vkCmdDispatch(commands, (work_groups - 1) / rows + 1, rows, 1);
}

void VkPlan::record() {
  const Api& api = gpu_.api();
  pool_ = gpu_.make_command_pool(0);
  VkCommandBufferAllocateInfo allocation = {};
  allocation.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_ALLOCATE_INFO;
  allocation.commandPool = pool_.get();
  allocation.level = VK_COMMAND_BUFFER_LEVEL_PRIMARY;
  allocation.commandBufferCount = 1;
  check(api.vkAllocateCommandBuffers(gpu_.get(), &allocation, &commands_), "recording a plan");
  VkCommandBufferBeginInfo begin = {};
  begin.sType = VK_STRUCTURE_TYPE_COMMAND_BUFFER_BEGIN_INFO;
  begin.flags = VK_COMMAND_BUFFER_USAGE_SIMULTANEOUS_USE_BIT;
  check(api.vkBeginCommandBuffer(commands_, &begin), "recording a plan");
  // After all that was submitted before: uploads, other plans, this one's last run.
  barrier(api, commands_, VK_PIPELINE_STAGE_TRANSFER_BIT | VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
          VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT);
  int level = 0;
  for (const Launch& launch : launches_) {
    if (launch.level != level) {
      barrier(api, commands_, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT);
    }
    level = launch.level;
    dispatch(commands_, launch);
  }
  if (gpu_.unified()) barrier(api, commands_, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, VK_PIPELINE_STAGE_HOST_BIT);
  check(api.vkEndCommandBuffer(commands_), "recording a plan");
}

std::vector<std::int64_t> VkPlan::time_steps() const {
  const Api& api = gpu_.api();
  const uint32_t bits = gpu_.device().timestamp_bits;
  if (bits == 0) return {};
  std::vector<std::int64_t> times(steps_, 0);
  const uint32_t count = static_cast<uint32_t>(launches_.size()) * 2;
  if (count == 0) return times;
  VkQueryPoolCreateInfo info = {};
  info.sType = VK_STRUCTURE_TYPE_QUERY_POOL_CREATE_INFO;
  info.queryType = VK_QUERY_TYPE_TIMESTAMP;
  info.queryCount = count;
  VkQueryPool object = VK_NULL_HANDLE;
  check(api.vkCreateQueryPool(gpu_.get(), &info, nullptr, &object), "making timestamps");
  const Handle<VkQueryPool> pool(gpu_.get(), object, api.vkDestroyQueryPool);
  gpu_.run_once("timing a plan", [&](VkCommandBuffer commands) {
    api.vkCmdResetQueryPool(commands, object, 0, count);
    uint32_t query = 0;
    for (const Launch& launch : launches_) {
      barrier(api, commands, VK_PIPELINE_STAGE_TRANSFER_BIT | VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
              VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT);
      api.vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, object, query++);
      dispatch(commands, launch);
      api.vkCmdWriteTimestamp(commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT, object, query++);
    }
    barrier(api, commands, VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT,
            VK_PIPELINE_STAGE_TRANSFER_BIT | VK_PIPELINE_STAGE_COMPUTE_SHADER_BIT | VK_PIPELINE_STAGE_HOST_BIT);
  });
  std::vector<u64> ticks(count);
  check(api.vkGetQueryPoolResults(gpu_.get(), object, 0, count, ticks.size() * sizeof ticks[0], ticks.data(),
                                  sizeof ticks[0], VK_QUERY_RESULT_64_BIT | VK_QUERY_RESULT_WAIT_BIT),
        "reading timestamps");
  const u64 mask = bits >= 64 ? ~u64{0} : (u64{1} << bits) - 1;
  for (std::size_t i = 0; i < launches_.size(); ++i) {
    const u64 passed = (ticks[2 * i + 1] - ticks[2 * i]) & mask;
    times[launches_[i].step] = static_cast<std::int64_t>(
        static_cast<double>(passed) * static_cast<double>(gpu_.device().properties.limits.timestampPeriod));
  }
  return times;
}

}  // namespace berth::vulkan
