#pragma once

#include <string>
#include <vector>

#include "vulkan/api.hpp"

namespace berth::vulkan {

/// One file of compiled pipelines. Nothing in it is needed: what cannot be read is as good as absent, what cannot be
/// written is not kept, and no function throws.
///
/// It is named after the device, the driver's build (pipelineCacheUUID) and a hash of the kernels, and holds
///   "berth vulkan 1\n"  CRC-32 of all that follows (little-endian)  the driver's data
/// Drivers check the header of their data but not always the rest: hence the sum.
class PipelineCache {
 public:
  /// `folder` is made when it is first written to; empty switches the cache off.
  PipelineCache(const std::string& folder, const VkPhysicalDeviceProperties& device);

  /// Where the file is or would be; empty when the cache is off.
  const std::string& path() const { return path_; }
  /// The driver's data, empty when there is none, the file is damaged or it is another driver's.
  std::vector<unsigned char> load() const;
  /// Keeps the data, in one step for other processes. Returns false when that was not possible.
  bool store(const std::vector<unsigned char>& data) const;

 private:
  std::string folder_;
  std::string path_;
  VkPhysicalDeviceProperties device_;
};

/// `chosen`, or $XDG_CACHE_HOME/berth, or $HOME/.cache/berth; empty when none of them is set.
std::string cache_folder(const std::string& chosen);

}  // namespace berth::vulkan
