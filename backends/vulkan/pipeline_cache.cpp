#include "vulkan/pipeline_cache.hpp"

#include <cstdio>
#include <cstring>

#include "spirv_kernels.hpp"

namespace berth::vulkan {
namespace {

const std::string kMagic = "berth vulkan 1\n";

std::string hex(u64 value, int digits) {
  char text[20];
  std::snprintf(text, sizeof text, "%0*llx", digits, static_cast<unsigned long long>(value));
  return text;
}

/// FNV-1a over the words of every kernel.
u64 kernels_hash() {
  u64 hash = 0xcbf29ce484222325u;
  for (const Op op : all_ops()) {
    for (const SpirvForm form : kSpirvForms) {
      const SpirvKernel& kernel = spirv_kernel(op, form);
      for (std::size_t i = 0; i < kernel.bytes / 4; ++i) hash = (hash ^ kernel.words[i]) * 0x100000001b3u;
    }
  }
  return hash;
}

/// What every driver's data begins with; the compiler lays it out like the specification.
bool is_for(const VkPhysicalDeviceProperties& device, const unsigned char* data, std::size_t bytes) {
  VkPipelineCacheHeaderVersionOne header = {};
  if (bytes < sizeof header) return false;
  std::memcpy(&header, data, sizeof header);
  return header.headerVersion == VK_PIPELINE_CACHE_HEADER_VERSION_ONE && header.vendorID == device.vendorID &&
         header.deviceID == device.deviceID &&
         std::memcmp(header.pipelineCacheUUID, device.pipelineCacheUUID, VK_UUID_SIZE) == 0;
}

}  // namespace

PipelineCache::PipelineCache(const std::string& folder, const VkPhysicalDeviceProperties& device)
    : folder_(folder), device_(device) {
  if (folder_.empty()) return;
  path_ = folder_ + "/" + hex(device.vendorID, 8) + hex(device.deviceID, 8) + "-";
  for (const uint8_t byte : device.pipelineCacheUUID) path_ += hex(byte, 2);
  path_ += "-" + hex(kernels_hash(), 16) + ".vkcache";
}

CacheBytes PipelineCache::load() const {
  if (path_.empty()) return {};
  CacheBytes data = read_cache_file(path_, kMagic);
  return is_for(device_, data.data(), data.size()) ? data : CacheBytes();
}

bool PipelineCache::store(const CacheBytes& data) const {
  return !path_.empty() && !data.empty() && write_cache_file(folder_, path_, kMagic, data);
}

}  // namespace berth::vulkan
