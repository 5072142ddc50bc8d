// The driver API's functions, as strict as they can be: whatever a driver might forgive is a complaint.
#include <algorithm>
#include <cstdint>
#include <cstdio>
#include <cstring>
#include <type_traits>

#include "berth/ops.hpp"
#include "machine.hpp"
#include "ptx.hpp"

using namespace fake_cuda;

#define DRIVER extern "C" __attribute__((visibility("default"))) CUresult

namespace {

using Lock = std::unique_lock<std::mutex>;

Machine& machine() { return Machine::get(); }

#define ENTER(function)                               \
  const CUresult entered = machine().enter(function); \
  if (entered != kSuccess) return entered;            \
  Lock lock(machine().mutex)

#define ENTER_CONTEXT(function)                               \
  const CUresult entered = machine().enter_context(function); \
  if (entered != kSuccess) return entered;                    \
  Lock lock(machine().mutex)

bool is_device(int device) { return device >= 0 && device < static_cast<int>(machine().capabilities.size()); }

/// Forgets an object, also when the call itself fails: a lost device keeps nothing.
template <class T>
CUresult give_back(const char* function, std::map<void*, std::shared_ptr<T>>& all, void* handle) {
  const CUresult entered = machine().enter_context(function);
  const Lock lock(machine().mutex);
  if (all.erase(handle) == 0) return machine().complain(kInvalidHandle, std::string(function) + ": no such object");
  return entered;
}

template <class T>
std::shared_ptr<T> find(const std::map<void*, std::shared_ptr<T>>& all, void* handle, const char* function) {
  const auto found = all.find(handle);
  if (found != all.end()) return found->second;
  machine().complain(kInvalidHandle, std::string(function) + ": no such object");
  return nullptr;
}

/// The launch with its arguments copied, or nothing with a complaint.
std::unique_ptr<Kernel> kernel_of(const char* caller, CUfunction function, const unsigned (&grid)[3],
                                  const unsigned (&block)[3], unsigned shared_bytes, void** params, void** extra) {
  const auto complain = [&](const std::string& what) {
    machine().complain(kInvalidValue, std::string(caller) + ": " + what);
    return nullptr;
  };
  if (machine().functions.count(function) == 0) return complain("no such function");
  const berth::Op op = reinterpret_cast<const Function*>(function)->op;
  const std::string name = berth::name_of(op);
  if (block[0] != berth::kGroupSize || block[1] != 1 || block[2] != 1) return complain(name + ": not groups of 128");
  if (grid[0] == 0 || grid[0] > 0x7fffffffu || grid[1] != 1 || grid[2] != 1) return complain(name + ": grid");
  if (shared_bytes != 0 || extra != nullptr || params == nullptr) return complain(name + ": launch parameters");
  auto kernel = std::make_unique<Kernel>();
  kernel->op = op;
  kernel->groups = grid[0];
  std::size_t at = 0;
  for (; at < berth::args_of(op).size(); ++at) {
    CUdeviceptr buffer = 0;
    std::memcpy(&buffer, params[at], sizeof buffer);
    if (machine().memory(buffer, 1, name.c_str()) == nullptr) return nullptr;
    kernel->buffers.push_back(buffer);
  }
  const auto* bytes = static_cast<const std::byte*>(params[at]);
  kernel->params.assign(bytes, bytes + berth::param_bytes(op));
  return kernel;
}

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

DRIVER cuStreamCreate(CUstream* stream, unsigned flags) {
  ENTER_CONTEXT("cuStreamCreate");
  if (flags != kStreamNonBlocking) return machine().complain(kInvalidValue, "cuStreamCreate: the default stream waits");
  auto queue = std::make_shared<Queue>();
  queue->worker = std::thread([queue] { machine().serve(queue); });
  *stream = reinterpret_cast<CUstream>(machine().own(machine().streams, queue));
  return kSuccess;
}
DRIVER cuStreamSynchronize(CUstream stream) {
  ENTER_CONTEXT("cuStreamSynchronize");
  const std::shared_ptr<Queue> queue = find(machine().streams, stream, "cuStreamSynchronize");
  if (queue == nullptr) return kInvalidHandle;
  const std::uint64_t all = queue->taken;
  machine().changed.wait(lock, [&] { return queue->done >= all; });
  return machine().lost;
}
DRIVER cuStreamDestroy_v2(CUstream stream) {
  std::shared_ptr<Queue> queue;
  {
    const Lock lock(machine().mutex);
    queue = find(machine().streams, stream, "cuStreamDestroy_v2");
    if (queue == nullptr) return kInvalidHandle;
    queue->closing = true;  // what was enqueued is still done
    machine().changed.notify_all();
  }
  queue->worker.join();
  return give_back("cuStreamDestroy_v2", machine().streams, stream);
}

DRIVER cuEventCreate(CUevent* event, unsigned flags) {
  ENTER_CONTEXT("cuEventCreate");
  if (flags != kEventDisableTiming && flags != kEventTiming) {
    return machine().complain(kInvalidValue, "cuEventCreate: flags");
  }
  auto made = std::make_shared<EventState>();
  made->timed = flags == kEventTiming;
  *event = reinterpret_cast<CUevent>(machine().own(machine().events, made));
  return kSuccess;
}
DRIVER cuEventRecord(CUevent event, CUstream stream) {
  ENTER_CONTEXT("cuEventRecord");
  const std::shared_ptr<EventState> recorded = find(machine().events, event, "cuEventRecord");
  const std::shared_ptr<Queue> queue = find(machine().streams, stream, "cuEventRecord");
  if (recorded == nullptr || queue == nullptr) return kInvalidHandle;
  if (recorded->timed) {
    machine().enqueue(queue, [recorded] {
      const Lock at_work(machine().mutex);
      recorded->when_ms = machine().clock_ms;
    });
  }
  recorded->queue = queue;
  recorded->after = queue->taken;
  return kSuccess;
}
DRIVER cuEventSynchronize(CUevent event) {
  ENTER_CONTEXT("cuEventSynchronize");
  const std::shared_ptr<EventState> waited = find(machine().events, event, "cuEventSynchronize");
  if (waited == nullptr) return kInvalidHandle;
  if (waited->queue == nullptr) return machine().complain(kInvalidHandle, "cuEventSynchronize: never recorded");
  const EventState state = *waited;  // as it is now: it may be recorded again meanwhile
  machine().changed.wait(lock, [&] { return state.queue->done >= state.after; });
  return machine().lost;
}
static CUresult elapsed(const char* function, float* ms, CUevent from, CUevent to) {
  ENTER_CONTEXT(function);
  const std::shared_ptr<EventState> first = find(machine().events, from, function);
  const std::shared_ptr<EventState> last = find(machine().events, to, function);
  if (first == nullptr || last == nullptr) return kInvalidHandle;
  for (const auto& event : {first, last}) {
    if (!event->timed || event->queue == nullptr || event->queue->done < event->after) {
      return machine().complain(kInvalidHandle, std::string(function) + ": no time was taken");
    }
  }
  *ms = static_cast<float>(last->when_ms - first->when_ms);
  return kSuccess;
}
#if FAKE_CUDA_VERSION >= 12
DRIVER cuEventElapsedTime_v2(float* ms, CUevent from, CUevent to) {
  return elapsed("cuEventElapsedTime_v2", ms, from, to);
}
#else
DRIVER cuEventElapsedTime(float* ms, CUevent from, CUevent to) { return elapsed("cuEventElapsedTime", ms, from, to); }
#endif
DRIVER cuEventDestroy_v2(CUevent event) { return give_back("cuEventDestroy_v2", machine().events, event); }

DRIVER cuLaunchKernel(CUfunction function, unsigned grid_x, unsigned grid_y, unsigned grid_z, unsigned block_x,
                      unsigned block_y, unsigned block_z, unsigned shared_bytes, CUstream stream, void** params,
                      void** extra) {
  ENTER_CONTEXT("cuLaunchKernel");
  const std::shared_ptr<Queue> queue = find(machine().streams, stream, "cuLaunchKernel");
  std::shared_ptr<const Kernel> kernel = kernel_of("cuLaunchKernel", function, {grid_x, grid_y, grid_z},
                                                   {block_x, block_y, block_z}, shared_bytes, params, extra);
  if (queue == nullptr || kernel == nullptr) return kInvalidValue;
  machine().enqueue(queue, [kernel] { machine().run(*kernel); });
  return kSuccess;
}

#if FAKE_CUDA_GRAPHS
DRIVER cuGraphCreate(CUgraph* graph, unsigned flags) {
  ENTER_CONTEXT("cuGraphCreate");
  if (flags != 0) return machine().complain(kInvalidValue, "cuGraphCreate: flags");
  *graph = reinterpret_cast<CUgraph>(machine().own(machine().graphs, std::make_shared<Graph>()));
  return kSuccess;
}
DRIVER cuGraphAddKernelNode(CUgraphNode* node, CUgraph graph, const CUgraphNode* dependencies, std::size_t count,
                            const KernelNodeParams* p) {
  ENTER_CONTEXT("cuGraphAddKernelNode");
  const std::shared_ptr<Graph> to = find(machine().graphs, graph, "cuGraphAddKernelNode");
  if (to == nullptr) return kInvalidHandle;
  // Every launch reads what the one before it wrote; this driver would run them in order anyway, a real one would not.
  const void* last = to->nodes.empty() ? nullptr : to->nodes.back().get();
  if (count != (last == nullptr ? 0u : 1u) || (last != nullptr && static_cast<const void*>(dependencies[0]) != last)) {
    return machine().complain(kInvalidValue, "cuGraphAddKernelNode: it does not follow the node before it");
  }
  std::unique_ptr<Kernel> kernel =
      kernel_of("cuGraphAddKernelNode", p->function, {p->grid_x, p->grid_y, p->grid_z},
                {p->block_x, p->block_y, p->block_z}, p->shared_bytes, p->kernel_params, p->extra);
  if (kernel == nullptr) return kInvalidValue;
  *node = reinterpret_cast<CUgraphNode>(kernel.get());
  to->nodes.push_back(std::move(kernel));
  return kSuccess;
}
static CUresult instantiate(const char* function, CUgraphExec* exec, CUgraph graph) {
  ENTER_CONTEXT(function);
  const std::shared_ptr<Graph> from = find(machine().graphs, graph, function);
  if (from == nullptr) return kInvalidHandle;
  auto copy = std::make_shared<Graph>();
  for (const auto& node : from->nodes) copy->nodes.push_back(std::make_unique<Kernel>(*node));
  *exec = reinterpret_cast<CUgraphExec>(machine().own(machine().execs, copy));
  return kSuccess;
}
#if FAKE_CUDA_VERSION >= 12
DRIVER cuGraphInstantiateWithFlags(CUgraphExec* exec, CUgraph graph, unsigned long long) {
  return instantiate("cuGraphInstantiateWithFlags", exec, graph);
}
#elif FAKE_CUDA_VERSION >= 11
DRIVER cuGraphInstantiate_v2(CUgraphExec* exec, CUgraph graph, CUgraphNode*, char*, std::size_t) {
  return instantiate("cuGraphInstantiate_v2", exec, graph);
}
#else
DRIVER cuGraphInstantiate(CUgraphExec* exec, CUgraph graph, CUgraphNode*, char*, std::size_t) {
  return instantiate("cuGraphInstantiate", exec, graph);
}
#endif
DRIVER cuGraphLaunch(CUgraphExec exec, CUstream stream) {
  ENTER_CONTEXT("cuGraphLaunch");
  const std::shared_ptr<Queue> queue = find(machine().streams, stream, "cuGraphLaunch");
  const std::shared_ptr<Graph> graph = find(machine().execs, exec, "cuGraphLaunch");
  if (queue == nullptr || graph == nullptr) return kInvalidHandle;
  machine().enqueue(queue, [graph] {
    for (const auto& node : graph->nodes) machine().run(*node);
  });
  return kSuccess;
}
DRIVER cuGraphExecDestroy(CUgraphExec exec) { return give_back("cuGraphExecDestroy", machine().execs, exec); }
DRIVER cuGraphDestroy(CUgraph graph) { return give_back("cuGraphDestroy", machine().graphs, graph); }
#endif

// What the backend declares is what is here.
#define X(function, parameters) static_assert(std::is_same_v<decltype(&function), CUresult(*) parameters>, #function);
BERTH_CUDA_FUNCTIONS(X)
#if FAKE_CUDA_GRAPHS
BERTH_CUDA_GRAPH_FUNCTIONS(X)
#endif
#undef X
