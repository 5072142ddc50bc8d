// The backend behind Vulkan: a buffer is a storage buffer with memory of its own, a plan a command buffer, a stream a
// line of submissions to the one queue. Everything here throws; nothing in stream.cpp does.
#include <algorithm>
#include <atomic>
#include <cstring>

#include "berth/error.hpp"
#include "vulkan/stream.hpp"
#include "vulkan/vulkan.hpp"

namespace berth::vulkan {
namespace {

// A stream's staging ring: room for all buffers made so far, within reason. More than one frame ever copies.
constexpr std::size_t kLeastStaging = std::size_t{64} << 10;
constexpr std::size_t kMostStaging = std::size_t{32} << 20;

class VkBackend final : public Backend {
 public:
  VkBackend(const BackendOptions& options, const Instruments& instruments)
      : gpu_(options, instruments),
        kernels_(make_kernels(gpu_, PipelineCache(cache_folder(options.cache_dir), gpu_.device().properties))) {}

  const char* name() const override { return "vulkan"; }
  DeviceInfo device() const override { return {gpu_.device().name, gpu_.device().driver}; }

  std::unique_ptr<Buffer> make_buffer(std::size_t bytes) override {
    Memory memory = make_storage(gpu_, bytes);
    if (memory.host != nullptr) {
      std::memset(memory.host, 0, bytes);
    } else {
      const VkBuffer handle = memory.buffer.get();
      gpu_.run_once("zeroing a buffer", [&](VkCommandBuffer commands) {
        gpu_.api().vkCmdFillBuffer(commands, handle, 0, VK_WHOLE_SIZE, 0);
      });
    }
    bytes_made_ += bytes;
    return std::make_unique<VkStorage>(bytes, gpu_, std::move(memory));
  }

  std::unique_ptr<Stream> make_stream() override {
    return vulkan::make_stream(gpu_, std::max(kLeastStaging, std::min(kMostStaging, bytes_made_.load())));
  }

  std::unique_ptr<Plan> record(const std::vector<Step>& steps) override {
    return std::make_unique<VkPlan>(gpu_, kernels_, steps);
  }

 private:
  Gpu gpu_;
  Kernels kernels_;
  std::atomic<std::size_t> bytes_made_{0};
};

}  // namespace

std::vector<DeviceInfo> devices(std::string& absent_reason) {
  absent_reason.clear();
  std::vector<DeviceInfo> infos;
  try {
    const Instance instance{Instruments()};
    for (const Device& device : find_devices(instance)) infos.push_back({device.name, device.driver});
  } catch (const Error& error) {
    absent_reason = error.what();
  }
  return infos;
}

std::unique_ptr<Backend> open(const BackendOptions& options) { return open(options, Instruments()); }

std::unique_ptr<Backend> open(const BackendOptions& options, const Instruments& instruments) {
  return std::make_unique<VkBackend>(options, instruments);
}

BackendEntry entry() { return {"vulkan", &devices, &open}; }

}  // namespace berth::vulkan
