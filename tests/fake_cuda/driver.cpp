// The driver API's functions, as strict as they can be: whatever a driver might forgive is a complaint. Here those of
// devices, contexts, modules and memory; what runs is in driver_streams.cpp.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstring>

#include "berth/ops.hpp"
#include "driver_call.hpp"
#include "ptx.hpp"

using namespace fake_cuda;

namespace {

bool is_device(int device) { return device >= 0 && device < static_cast<int>(machine().capabilities.size()); }

}  // namespace

DRIVER cuInit(unsigned flags) {
  ENTER("cuInit");
  if (flags != 0) return machine().complain(kInvalidValue, "cuInit: flags");
  return machine().capabilities.empty() ? kNoDevice : kSuccess;
}
DRIVER cuDriverGetVersion(int* version) {
  ENTER("cuDriverGetVersion");
  *version = machine().version;
  return kSuccess;
}
DRIVER cuGetErrorName(CUresult error, const char** name) {
  switch (error) {
    case kInvalidValue:
      *name = "CUDA_ERROR_INVALID_VALUE";
      return kSuccess;
    case kOutOfMemory:
      *name = "CUDA_ERROR_OUT_OF_MEMORY";
      return kSuccess;
    case kNoDevice:
      *name = "CUDA_ERROR_NO_DEVICE";
      return kSuccess;
    case kLaunchFailed:
      *name = "CUDA_ERROR_LAUNCH_FAILED";
      return kSuccess;
    default:
      *name = nullptr;
      return kInvalidValue;
  }
}
DRIVER cuDeviceGetCount(int* count) {
  ENTER("cuDeviceGetCount");
  *count = static_cast<int>(machine().capabilities.size());
  return kSuccess;
}
DRIVER cuDeviceGet(CUdevice* device, int ordinal) {
  ENTER("cuDeviceGet");
  if (!is_device(ordinal)) return machine().complain(kInvalidValue, "cuDeviceGet: no such device");
  *device = ordinal;
  return kSuccess;
}
DRIVER cuDeviceGetName(char* name, int bytes, CUdevice device) {
  ENTER("cuDeviceGetName");
  if (!is_device(device)) return machine().complain(kInvalidValue, "cuDeviceGetName: no such device");
  const int capability = machine().capabilities[static_cast<std::size_t>(device)];
  std::snprintf(name, static_cast<std::size_t>(bytes), "Fake GPU %d (%d.%d)", device, capability / 10, capability % 10);
  return kSuccess;
}
DRIVER cuDeviceGetAttribute(int* value, int attribute, CUdevice device) {
  ENTER("cuDeviceGetAttribute");
  if (!is_device(device)) return machine().complain(kInvalidValue, "cuDeviceGetAttribute: no such device");
  const int capability = machine().capabilities[static_cast<std::size_t>(device)];
  if (attribute == kAttributeComputeCapabilityMajor) {
    *value = capability / 10;
  } else if (attribute == kAttributeComputeCapabilityMinor) {
    *value = capability % 10;
  } else {
    return machine().complain(kInvalidValue, "cuDeviceGetAttribute: unknown attribute");
  }
  return kSuccess;
}

DRIVER cuDevicePrimaryCtxRetain(CUcontext* context, CUdevice device) {
  ENTER("cuDevicePrimaryCtxRetain");
  if (!is_device(device)) return machine().complain(kInvalidValue, "cuDevicePrimaryCtxRetain: no such device");
  machine().retained[device] += 1;
  *context = context_of(device);
  return kSuccess;
}
static CUresult release_context(const char* function, CUdevice device) {
  const CUresult entered = machine().enter(function);
  const Lock lock(machine().mutex);
  if (machine().retained[device] == 0) return machine().complain(kInvalidContext, std::string(function) + ": twice");
  machine().retained[device] -= 1;
  if (machine().live() > 0 && std::all_of(machine().retained.begin(), machine().retained.end(),
                                          [](const auto& held) { return held.second == 0; })) {
    return machine().complain(kInvalidContext, std::string(function) + ": objects are left in the context");
  }
  return entered;
}
#if FAKE_CUDA_VERSION >= 11
DRIVER cuDevicePrimaryCtxRelease_v2(CUdevice device) { return release_context("cuDevicePrimaryCtxRelease_v2", device); }
#else
DRIVER cuDevicePrimaryCtxRelease(CUdevice device) { return release_context("cuDevicePrimaryCtxRelease", device); }
#endif
DRIVER cuCtxPushCurrent_v2(CUcontext context) {
  ENTER("cuCtxPushCurrent_v2");
  Machine::contexts().push_back(context);
  return kSuccess;
}
DRIVER cuCtxPopCurrent_v2(CUcontext* context) {
  const CUresult entered = machine().enter("cuCtxPopCurrent_v2");
  const Lock lock(machine().mutex);
  if (Machine::contexts().empty()) return machine().complain(kInvalidContext, "cuCtxPopCurrent_v2: none");
  *context = Machine::contexts().back();
  Machine::contexts().pop_back();
  return entered;
}

DRIVER cuModuleLoadDataEx(CUmodule* module, const void* image, unsigned count, int* options, void** values) {
  ENTER_CONTEXT("cuModuleLoadDataEx");
  char* log = nullptr;
  std::size_t log_bytes = 0;
  for (unsigned i = 0; i < count; ++i) {
    if (options[i] == kJitErrorLogBuffer) {
      log = static_cast<char*>(values[i]);
    } else if (options[i] == kJitErrorLogBufferBytes) {
      log_bytes = reinterpret_cast<std::uintptr_t>(values[i]);
    } else {
      return machine().complain(kInvalidValue, "cuModuleLoadDataEx: unknown option");
    }
  }
  constexpr std::uint32_t kFatbinMagic = 0xba55ed50u;
  std::uint32_t magic = 0;
  std::memcpy(&magic, image, sizeof magic);
  auto made = std::make_shared<Module>();
  if (magic == kFatbinMagic) {
    machine().loaded = "fatbin";
  } else {
    machine().loaded = "ptx";
    made->entries = entries_of(static_cast<const char*>(image));
    made->knows_entries = true;
    if (made->entries.empty()) return machine().complain(kInvalidImage, "cuModuleLoadDataEx: not an image");
  }
  const auto refused = machine().refused.find(machine().loaded);
  if (refused != machine().refused.end()) {
    if (log != nullptr) std::snprintf(log, log_bytes, "%s", refused->second.second.c_str());
    return refused->second.first;
  }
  *module = reinterpret_cast<CUmodule>(machine().own(machine().modules, made));
  return kSuccess;
}
DRIVER cuModuleUnload(CUmodule module) {
  {
    const Lock lock(machine().mutex);
    const auto found = machine().modules.find(module);
    if (found != machine().modules.end()) {
      for (const auto& function : found->second->functions) machine().functions.erase(function.get());
    }
  }
  return give_back("cuModuleUnload", machine().modules, module);
}
DRIVER cuModuleGetFunction(CUfunction* function, CUmodule module, const char* name) {
  ENTER_CONTEXT("cuModuleGetFunction");
  const std::shared_ptr<Module> in = find(machine().modules, module, "cuModuleGetFunction");
  if (in == nullptr) return kInvalidHandle;
  for (const berth::Op op : berth::all_ops()) {
    if (std::string("berth_") + berth::name_of(op) != name) continue;
    std::vector<std::size_t> arguments(berth::args_of(op).size(), 8);
    arguments.push_back(berth::param_bytes(op));
    if (in->knows_entries && in->entries[name] != arguments) {
      return machine().complain(kNotFound, std::string(name) + ": the module's takes other arguments");
    }
    in->functions.push_back(std::make_unique<Function>(Function{op}));
    machine().functions.insert(in->functions.back().get());
    *function = reinterpret_cast<CUfunction>(in->functions.back().get());
    return kSuccess;
  }
  return kNotFound;
}

DRIVER cuMemAlloc_v2(CUdeviceptr* memory, std::size_t bytes) {
  ENTER_CONTEXT("cuMemAlloc_v2");
  if (bytes == 0) return machine().complain(kInvalidValue, "cuMemAlloc_v2: no bytes");
  if (bytes > (std::size_t{1} << 40) ||
      bytes > machine().memory_limit - std::min(machine().memory_limit, machine().device_bytes)) {
    return kOutOfMemory;
  }
  std::unique_ptr<unsigned char[]> allocated(new unsigned char[bytes]);
  std::memset(allocated.get(), 0xa5, bytes);
  *memory = reinterpret_cast<std::uintptr_t>(allocated.get()) | kDeviceBit;
  machine().device_bytes += bytes;
  machine().device_memory.emplace(*memory, std::make_pair(std::move(allocated), bytes));
  return kSuccess;
}
// Both wait for the device first, as CUDA's do.
DRIVER cuMemFree_v2(CUdeviceptr memory) {
  const CUresult entered = machine().enter_context("cuMemFree_v2");
  Lock lock(machine().mutex);
  machine().wait_until_idle(lock);
  const auto found = machine().device_memory.find(memory);
  if (found == machine().device_memory.end()) return machine().complain(kInvalidValue, "cuMemFree_v2: not memory");
  machine().device_bytes -= found->second.second;
  machine().device_memory.erase(found);
  return entered;
}
DRIVER cuMemHostAlloc(void** memory, std::size_t bytes, unsigned flags) {
  ENTER_CONTEXT("cuMemHostAlloc");
  if (bytes == 0 || flags != 0) return machine().complain(kInvalidValue, "cuMemHostAlloc: arguments");
  std::unique_ptr<unsigned char[]> allocated(new unsigned char[bytes]);
  std::memset(allocated.get(), 0x5a, bytes);
  unsigned char* address = allocated.get();
  *memory = address;
  machine().host_memory.emplace(address, std::make_pair(std::move(allocated), bytes));
  return kSuccess;
}
DRIVER cuMemFreeHost(void* memory) {
  const CUresult entered = machine().enter_context("cuMemFreeHost");
  Lock lock(machine().mutex);
  machine().wait_until_idle(lock);
  if (machine().host_memory.erase(static_cast<unsigned char*>(memory)) == 0) {
    return machine().complain(kInvalidValue, "cuMemFreeHost: not memory");
  }
  return entered;
}
DRIVER cuMemsetD8Async(CUdeviceptr memory, unsigned char value, std::size_t bytes, CUstream stream) {
  ENTER_CONTEXT("cuMemsetD8Async");
  const std::shared_ptr<Queue> queue = find(machine().streams, stream, "cuMemsetD8Async");
  unsigned char* to = machine().memory(memory, bytes, "cuMemsetD8Async");
  if (queue == nullptr || to == nullptr) return kInvalidValue;
  machine().enqueue(queue, [=] { std::memset(to, value, bytes); });
  return kSuccess;
}
DRIVER cuMemcpyHtoDAsync_v2(CUdeviceptr memory, const void* from, std::size_t bytes, CUstream stream) {
  ENTER_CONTEXT("cuMemcpyHtoDAsync_v2");
  const std::shared_ptr<Queue> queue = find(machine().streams, stream, "cuMemcpyHtoDAsync_v2");
  unsigned char* to = machine().memory(memory, bytes, "cuMemcpyHtoDAsync_v2");
  if (queue == nullptr || to == nullptr) return kInvalidValue;
  if (!machine().pinned(from, bytes)) return machine().complain(kInvalidValue, "cuMemcpyHtoDAsync_v2: not pinned");
  machine().enqueue(queue, [=] { std::memcpy(to, from, bytes); });
  return kSuccess;
}
DRIVER cuMemcpyDtoHAsync_v2(void* to, CUdeviceptr memory, std::size_t bytes, CUstream stream) {
  ENTER_CONTEXT("cuMemcpyDtoHAsync_v2");
  const std::shared_ptr<Queue> queue = find(machine().streams, stream, "cuMemcpyDtoHAsync_v2");
  const unsigned char* from = machine().memory(memory, bytes, "cuMemcpyDtoHAsync_v2");
  if (queue == nullptr || from == nullptr) return kInvalidValue;
  if (!machine().pinned(to, bytes)) return machine().complain(kInvalidValue, "cuMemcpyDtoHAsync_v2: not pinned");
  machine().enqueue(queue, [=] { std::memcpy(to, from, bytes); });
  return kSuccess;
}
