#pragma once

#include <string>

#include "cache_file.hpp"
#include "vulkan/api.hpp"

namespace berth::vulkan {

/// One file of compiled pipelines. Nothing in it is needed: what cannot be read is as good as absent, what cannot be
/// written is not kept, and no function throws.
///
/// A cache file (cache_file.hpp), named after the device, the driver's build (pipelineCacheUUID) and a hash of the
/// kernels, that holds the driver's data behind the magic "berth vulkan 1\n".
/// Drivers check the header of their data but not always the rest: hence the sum.
class PipelineCache {
 public:
  /// `folder` is made when it is first written to; empty switches the cache off.
  PipelineCache(const std::string& folder, const VkPhysicalDeviceProperties& device);

  /// Where the file is or would be; empty when the cache is off.
  const std::string& path() const { return path_; }
  /// The driver's data, empty when there is none, the file is damaged or it is another driver's.
  CacheBytes load() const;
  /// Keeps the data, in one step for other processes. Returns false when that was not possible.
  bool store(const CacheBytes& data) const;

 private:
  std::string folder_;
  std::string path_;
  VkPhysicalDeviceProperties device_;
};

}  // namespace berth::vulkan
