#include "cuda/driver.hpp"

#include <dlfcn.h>

#include <cstdlib>
#include <vector>

#include "berth/error.hpp"

namespace berth::cuda {
namespace {

constexpr int kOldestDriver = 10020;
constexpr const char* kInstallDriver =
    "install NVIDIA's driver (apt install nvidia-driver; on Jetson it is part of L4T)";

std::string last_dl_error() {
  const char* text = dlerror();
  return text != nullptr ? text : "unknown error";
}

void* open_library(std::string& opened) {
  std::vector<std::string> names = {"libcuda.so.1", "libcuda.so"};
  const char* chosen = std::getenv("BERTH_CUDA_LIBRARY");
  if (chosen != nullptr && chosen[0] != '\0') names = {chosen};
  std::string reason;
  for (const std::string& name : names) {
    // NODELETE: the driver keeps threads and thread-local state, which must not lose its code.
    if (void* library = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE)) {
      opened = name;
      return library;
    }
    if (reason.empty()) reason = last_dl_error();
  }
  if (chosen != nullptr && chosen[0] != '\0') {
    throw Error("cuda: BERTH_CUDA_LIBRARY cannot be opened (" + reason + "); unset it or name a CUDA driver library");
  }
  throw Error("cuda: no CUDA driver (" + reason + "); " + kInstallDriver);
}

Api resolve() {
  std::string name;
  void* library = open_library(name);
  Api api;
#define X(function, parameters) api.function = reinterpret_cast<decltype(api.function)>(dlsym(library, #function));
  BERTH_CUDA_FUNCTIONS(X)
  BERTH_CUDA_GRAPH_FUNCTIONS(X)
  BERTH_CUDA_RENAMED_FUNCTIONS(X)
#undef X
  const char* missing = nullptr;
#define X(function, parameters) \
  if (missing == nullptr && api.function == nullptr) missing = #function;
  BERTH_CUDA_FUNCTIONS(X)
#undef X
  if (missing == nullptr && api.cuDevicePrimaryCtxRelease_v2 == nullptr && api.cuDevicePrimaryCtxRelease == nullptr) {
    missing = "cuDevicePrimaryCtxRelease";
  }
  if (missing == nullptr && api.cuEventElapsedTime_v2 == nullptr && api.cuEventElapsedTime == nullptr) {
    missing = "cuEventElapsedTime";
  }
  if (missing != nullptr) {
    throw Error("cuda: " + name + " lacks " + missing + "; Berth needs a driver for CUDA " +
                version_text(kOldestDriver) + " or later");
  }
  api.has_graphs = api.cuGraphInstantiateWithFlags != nullptr || api.cuGraphInstantiate_v2 != nullptr ||
                   api.cuGraphInstantiate != nullptr;
#define X(function, parameters) api.has_graphs = api.has_graphs && api.function != nullptr;
  BERTH_CUDA_GRAPH_FUNCTIONS(X)
#undef X
  return api;
}

}  // namespace

CUresult Api::release_primary_context(CUdevice device) const {
  return cuDevicePrimaryCtxRelease_v2 != nullptr ? cuDevicePrimaryCtxRelease_v2(device)
                                                 : cuDevicePrimaryCtxRelease(device);
}

CUresult Api::elapsed(float* ms, CUevent from, CUevent to) const {
  return cuEventElapsedTime_v2 != nullptr ? cuEventElapsedTime_v2(ms, from, to) : cuEventElapsedTime(ms, from, to);
}

CUresult Api::instantiate(CUgraphExec* exec, CUgraph graph) const {
  if (cuGraphInstantiateWithFlags != nullptr) return cuGraphInstantiateWithFlags(exec, graph, 0);
  if (cuGraphInstantiate_v2 != nullptr) return cuGraphInstantiate_v2(exec, graph, nullptr, nullptr, 0);
  return cuGraphInstantiate(exec, graph, nullptr, nullptr, 0);
}

Api load_api() {
  Api api = resolve();
  // The version may be asked before cuInit, which an old driver may refuse for reasons of its own.
  check(api, api.cuDriverGetVersion(&api.version), "asking for the driver's version");
  if (api.version < kOldestDriver) {
    throw Error("cuda: the driver is for CUDA " + version_text(api.version) + "; Berth needs one for CUDA " +
                version_text(kOldestDriver) + " or later");
  }
  const CUresult status = api.cuInit(0);
  if (status == kNoDevice) {
    throw Error("cuda: the driver finds no device; see nvidia-smi, and CUDA_VISIBLE_DEVICES if it is set");
  }
  if (status != kSuccess) {
    throw Error("cuda: starting the driver failed (" + describe_status(api, status) +
                "); does nvidia-smi work? A driver that was just updated needs a restart");
  }
  return api;
}

std::string describe_status(const Api& api, CUresult status) {
  const char* name = nullptr;
  const bool known = api.cuGetErrorName(status, &name) == kSuccess && name != nullptr;
  return std::to_string(status) + (known ? " " + std::string(name) : std::string());
}

void check(const Api& api, CUresult status, const std::string& what) {
  if (status != kSuccess) throw Error("cuda: " + what + " failed (" + describe_status(api, status) + ")");
}

std::string version_text(int version) {
  return std::to_string(version / 1000) + "." + std::to_string(version % 1000 / 10);
}

}  // namespace berth::cuda
