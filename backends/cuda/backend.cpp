// The backend behind CUDA: a buffer is device memory, a stream a CUDA stream with pinned memory for its copies, a plan
// a graph. Everything here throws; nothing in stream.cpp does once a stream is made.
#include <algorithm>
#include <atomic>

#include "berth/error.hpp"
#include "cuda/context.hpp"
#include "cuda/cuda.hpp"
#include "cuda/devices.hpp"
#include "cuda/driver.hpp"
#include "cuda/module.hpp"
#include "cuda/stream.hpp"

namespace berth::cuda {
namespace {

/// What a stream made after its buffers reserves at most: copies of all of them at once. More than this (a frame of
/// tens of megapixels) is asked for when it is first needed.
constexpr std::size_t kMostStaging = std::size_t{32} << 20;

DeviceInfo info_of(const Api& api, const Device& device) {
  return {device.name,
          "CUDA " + version_text(api.version) + ", compute capability " + capability_text(device.capability)};
}

Device pick(const Api& api, const BackendOptions& options) {
  const std::vector<Device> found = find_devices(api);
  return found[choose_device(found, options.device)];
}

class CudaBackend final : public Backend {
 public:
  CudaBackend(const Api& api, const Device& device, bool baseline_only)
      : device_(device),
        context_(api, device.handle, device.name),
        info_(info_of(api, device)),
        use_graphs_(api.has_graphs && !baseline_only) {
    const Current current(context_);
    current.require();
    CUstream stream = nullptr;
    check(api, api.cuStreamCreate(&stream, kStreamNonBlocking), "making a stream on " + device_.name);
    setup_stream_ = {context_, stream, api.cuStreamDestroy_v2};
    module_ = load_kernels(context_, device_, baseline_only);
    for (const Op op : all_ops()) {
      const std::string name = std::string("berth_") + name_of(op);  // see kernels/prelude/cuda.h
      CUfunction function = nullptr;
      check(api, api.cuModuleGetFunction(&function, module_.get(), name.c_str()), "finding the kernel " + name);
      functions_.push_back(function);
    }
  }

  const char* name() const override { return "cuda"; }
  DeviceInfo device() const override { return info_; }

  std::unique_ptr<Buffer> make_buffer(std::size_t bytes) override {
    const Api& api = context_.api();
    const Current current(context_);
    current.require();
    const std::string what = "a buffer of " + std::to_string(bytes) + " bytes on " + device_.name;
    const std::size_t room = std::max<std::size_t>(bytes, 4);  // CUDA has no empty memory
    CUdeviceptr address = 0;
    check(api, api.cuMemAlloc_v2(&address, room), what);
    Handle<CUdeviceptr> memory(context_, address, api.cuMemFree_v2);
    check(api, api.cuMemsetD8Async(address, 0, room, setup_stream_.get()), what);
    check(api, api.cuStreamSynchronize(setup_stream_.get()), what);
    return std::make_unique<CudaBuffer>(bytes, context_, std::move(memory), buffer_bytes_);
  }

  std::unique_ptr<Stream> make_stream() override {
    return cuda::make_stream(context_, std::min<std::size_t>(buffer_bytes_, kMostStaging));
  }

  std::unique_ptr<Plan> record(const std::vector<Step>& steps) override {
    auto plan = std::make_unique<CudaPlan>();
    for (const Step& step : steps) plan->launches.push_back(launch_of(step));
    if (use_graphs_) plan->graph = make_graph(plan->launches);
    return plan;
  }

 private:
  Launch launch_of(const Step& step) const {
    const std::string what = std::string("an argument of ") + name_of(step.op);
    if (step.buffers.size() != args_of(step.op).size() || step.params.size() != param_bytes(step.op)) {
      throw Error("cuda: " + what + " is missing; make steps with make_step");
    }
    Launch launch;
    launch.function = functions_[static_cast<std::size_t>(step.op)];
    launch.groups = step.items <= 0 ? 0 : (static_cast<unsigned>(step.items) + kGroupSize - 1) / kGroupSize;
    for (Buffer* buffer : step.buffers) {
      const auto* mine = dynamic_cast<const CudaBuffer*>(buffer);
      if (mine == nullptr || mine->context() != &context_) {
        throw Error("cuda: " + what + " is not a buffer of this backend");
      }
      launch.buffers.push_back(mine->memory());
    }
    launch.params = step.params;
    for (CUdeviceptr& buffer : launch.buffers) launch.arguments.push_back(&buffer);
    launch.arguments.push_back(launch.params.data());
    return launch;
  }

  /// The launches as a chain.
  Handle<CUgraphExec> make_graph(std::vector<Launch>& launches) {
    const Api& api = context_.api();
    const Current current(context_);
    current.require();
    CUgraph made = nullptr;
    check(api, api.cuGraphCreate(&made, 0), "making a plan's graph");
    const Handle<CUgraph> graph(context_, made, api.cuGraphDestroy);
    CUgraphNode last = nullptr;
    for (Launch& launch : launches) {
      if (launch.groups == 0) continue;
      const KernelNodeParams params = {launch.function,         launch.groups, 1, 1, kGroupSize, 1, 1, 0,
                                       launch.arguments.data(), nullptr};
      CUgraphNode node = nullptr;
      check(api, api.cuGraphAddKernelNode(&node, graph.get(), &last, last == nullptr ? 0 : 1, &params),
            "adding a launch to a plan's graph");
      last = node;
    }
    CUgraphExec exec = nullptr;
    check(api, api.instantiate(&exec, graph.get()),
          "instantiating a plan's graph of " + std::to_string(launches.size()) + " launches");
    return {context_, exec, api.cuGraphExecDestroy};
  }

  Device device_;
  Context context_;
  DeviceInfo info_;
  bool use_graphs_;
  Handle<CUstream> setup_stream_;
  Handle<CUmodule> module_;
  std::vector<CUfunction> functions_;         // by Op
  std::atomic<std::size_t> buffer_bytes_{0};  // of all buffers there are
};

}  // namespace

std::vector<DeviceInfo> devices(std::string& absent_reason) {
  absent_reason.clear();
  std::vector<DeviceInfo> infos;
  try {
    const Api api = load_api();
    for (const Device& device : find_devices(api)) infos.push_back(info_of(api, device));
  } catch (const Error& error) {
    absent_reason = error.what();
  }
  return infos;
}

std::unique_ptr<Backend> open(const BackendOptions& options) {
  const Api api = load_api();
  return std::make_unique<CudaBackend>(api, pick(api, options), options.baseline_only);
}

BackendEntry entry() { return {"cuda", &devices, &open}; }

}  // namespace berth::cuda
