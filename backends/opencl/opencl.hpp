#pragma once

#include <cstddef>
#include <memory>
#include <string>
#include <vector>

#include "berth/backend.hpp"
#include "entry.hpp"

/// Devices behind OpenCL 1.2. Nothing is linked: the loader is opened when it is first needed (docs/backends.md).
namespace berth::opencl {

/// The devices that can run Berth's kernels, over all platforms, in the order BackendOptions::device counts them.
/// Where there is none, absent_reason says why and what would help; otherwise it is empty. Never throws.
std::vector<DeviceInfo> devices(std::string& absent_reason);

/// Opens the device that options.device names. Throws Error when there is no such device, naming those there are, or
/// when its compiler rejects the kernels.
std::unique_ptr<Backend> open(const BackendOptions& options);

BackendEntry entry();

/// Where compiled kernels are kept and what lies there. The path is empty when nothing can be kept: options.cache_dir,
/// XDG_CACHE_HOME and HOME are all unset.
struct CacheInfo {
  std::string path;
  std::size_t entries;
  std::size_t bytes;
};
CacheInfo kernel_cache(const BackendOptions& options);

}  // namespace berth::opencl
