#include "cuda/module.hpp"

#include <algorithm>
#include <cstdint>

#include "berth/error.hpp"

namespace berth::cuda {

Handle<CUmodule> load_kernels(const Context& context, const Device& device, bool baseline_only) {
  const Api& api = context.api();
  std::string refused;
  std::vector<Image> images = device_images();
  if (baseline_only) std::reverse(images.begin(), images.end());
  for (const Image& image : images) {
    if (device.capability < image.least_capability) continue;
    std::string log(8192, '\0');
    int options[] = {kJitErrorLogBuffer, kJitErrorLogBufferBytes};
    // The driver takes the size in the pointer itself.
    void* values[] = {&log[0], reinterpret_cast<void*>(static_cast<std::uintptr_t>(log.size()))};
    CUmodule module = nullptr;
    const CUresult status = api.cuModuleLoadDataEx(&module, image.data, 2, options, values);
    if (status == kSuccess) return {context, module, api.cuModuleUnload};
    // Whatever the reason, the next image may do: a driver older than the compiler refuses its fatbin in several ways.
    log.resize(log.find('\0') == std::string::npos ? log.size() : log.find('\0'));
    log.erase(log.find_last_not_of(" \n") + 1);
    refused += (refused.empty() ? "" : "; ") + std::string(image.name) + ": " + describe_status(api, status) +
               (log.empty() ? "" : ", " + log);
  }
  throw Error("cuda: the driver, for CUDA " + version_text(api.version) + ", takes no image of the kernels for " +
              device.name + ", compute capability " + capability_text(device.capability) + " (" +
              (refused.empty() ? "this build has none for it" : refused) + "); update the driver");
}

}  // namespace berth::cuda
