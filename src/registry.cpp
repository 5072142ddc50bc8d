// The only file that names backends.
#include "berth/backend.hpp"
#include "berth/error.hpp"
#include "cpu/cpu_backend.hpp"
#include "entry.hpp"
#include "reference/reference_backend.hpp"
#include "simd/simd_backend.hpp"
#if BERTH_WITH_CUDA
#include "cuda/cuda.hpp"
#endif
#if BERTH_WITH_OPENCL
#include "opencl/opencl.hpp"
#endif
#if BERTH_WITH_VULKAN
#include "vulkan/vulkan.hpp"
#endif

namespace berth {
namespace {

// In order of preference for "the default".
const std::vector<BackendEntry>& entries() {
  static const std::vector<BackendEntry> all = {
    simd_backend::entry(),
    cpu_backend::entry(),
#if BERTH_WITH_CUDA
    cuda::entry(),
#endif
#if BERTH_WITH_VULKAN
    vulkan::entry(),
#endif
#if BERTH_WITH_OPENCL
    opencl::entry(),
#endif
    reference_backend::entry(),
  };
  return all;
}

}  // namespace

const std::vector<std::string>& backend_names() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> list;
    for (const BackendEntry& entry : entries()) list.emplace_back(entry.name);
    return list;
  }();
  return names;
}

std::vector<BackendStatus> probe_backends() {
  std::vector<BackendStatus> found;
  for (const BackendEntry& entry : entries()) {
    BackendStatus status{entry.name, {}, ""};
    status.devices = entry.devices(status.absent);
    found.push_back(std::move(status));
  }
  return found;
}

std::unique_ptr<Backend> open_backend(const std::string& name, const BackendOptions& options) {
  if (options.threads < 0 || options.threads > 256) {
    throw Error("threads is " + std::to_string(options.threads) + "; give 1 to 256, or 0 for every core");
  }
  std::string known;
  for (const BackendEntry& entry : entries()) {
    if (entry.name == name) return entry.open(options);
    known += (known.empty() ? "" : ", ") + std::string(entry.name);
  }
  throw Error("no backend '" + name + "'; this build has " + known);
}

}  // namespace berth
