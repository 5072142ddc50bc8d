// The driver API's functions of streams, events, launches and graphs.
#include <cstdint>
#include <cstring>

#include "berth/ops.hpp"
#include "driver_call.hpp"

using namespace fake_cuda;

namespace {

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
