// The backend behind OpenCL: a buffer is a cl_mem, a stream an in-order queue, a plan one kernel object a step with its
// arguments set for good. Everything here throws; nothing in stream.cpp does.
#include <dirent.h>
#include <sys/stat.h>

#include "berth/error.hpp"
#include "kernel_text.hpp"
#include "opencl/api.hpp"
#include "opencl/binary_cache.hpp"
#include "opencl/devices.hpp"
#include "opencl/opencl.hpp"
#include "opencl/program.hpp"
#include "opencl/stream.hpp"

namespace berth::opencl {
namespace {

DeviceInfo info_of(const Device& device) {
  return {device.name, device.platform_name + ", driver " + device.driver_version};
}

class ClBackend final : public Backend {
 public:
  explicit ClBackend(const BackendOptions& options) : api_(load_api()) {
    const std::vector<Device> found = find_devices(api_);
    std::vector<std::string> names;
    for (const Device& device : found) names.push_back(device.name);
    device_ = found[choose_device(names, options.device)];

    cl_int status = CL_SUCCESS;
    context_ = {api_.clCreateContext(nullptr, 1, &device_.id, nullptr, nullptr, &status), api_.clReleaseContext};
    check(status, "opening " + device_.name);
    setup_queue_ = make_queue();
    const BinaryCache cache(cache_folder(options.cache_dir));
    program_ = build_program(api_, context_.get(), device_, join(opencl_kernel_files()), cache).program;
    // Now rather than mid-plan: does every operation have its kernel, and does the device run it in whole groups?
    for (const Op op : all_ops()) check_group_size(op, make_kernel(op).get());
  }

  const char* name() const override { return "opencl"; }
  DeviceInfo device() const override { return info_of(device_); }

  std::unique_ptr<Buffer> make_buffer(std::size_t bytes) override {
    const std::string what = "a buffer of " + std::to_string(bytes) + " bytes on " + device_.name;
    const std::size_t room = bytes == 0 ? 4 : bytes;  // OpenCL has no empty buffers
    cl_int status = CL_SUCCESS;
    Handle<cl_mem> memory(api_.clCreateBuffer(context_.get(), CL_MEM_READ_WRITE, room, nullptr, &status),
                          api_.clReleaseMemObject);
    check(status, what);
    const cl_uchar zero = 0;
    check(api_.clEnqueueFillBuffer(setup_queue_.get(), memory.get(), &zero, 1, 0, room, 0, nullptr, nullptr), what);
    check(api_.clFinish(setup_queue_.get()), what);
    return std::make_unique<ClBuffer>(bytes, context_.get(), std::move(memory));
  }

  std::unique_ptr<Stream> make_stream() override { return opencl::make_stream(api_, make_queue()); }

  std::unique_ptr<Plan> record(const std::vector<Step>& steps) override {
    auto plan = std::make_unique<ClPlan>();
    for (const Step& step : steps) {
      if (step.items <= 0) continue;
      Handle<cl_kernel> kernel = make_kernel(step.op);
      set_arguments(kernel.get(), step);
      constexpr std::size_t kGroup = kGroupSize;
      plan->launches.push_back(
          {std::move(kernel), (static_cast<std::size_t>(step.items) + kGroup - 1) / kGroup * kGroup});
    }
    return plan;
  }

 private:
  Handle<cl_command_queue> make_queue() {
    cl_int status = CL_SUCCESS;
    Handle<cl_command_queue> queue(api_.clCreateCommandQueue(context_.get(), device_.id, 0, &status),
                                   api_.clReleaseCommandQueue);
    check(status, "making a queue on " + device_.name);
    return queue;
  }

  Handle<cl_kernel> make_kernel(Op op) {
    const std::string name = std::string("berth_") + name_of(op);  // see kernels/prelude/opencl.h
    cl_int status = CL_SUCCESS;
    Handle<cl_kernel> kernel(api_.clCreateKernel(program_.get(), name.c_str(), &status), api_.clReleaseKernel);
    check(status, std::string("finding the kernel ") + name_of(op));
    return kernel;
  }

  void check_group_size(Op op, cl_kernel kernel) {
    std::size_t most = 0;
    check(api_.clGetKernelWorkGroupInfo(kernel, device_.id, CL_KERNEL_WORK_GROUP_SIZE, sizeof most, &most, nullptr),
          std::string("asking about the kernel ") + name_of(op));
    if (most < static_cast<std::size_t>(kGroupSize)) {
      throw Error("opencl: " + device_.name + " runs " + name_of(op) + " with at most " + std::to_string(most) +
                  " work-items a group, not " + std::to_string(kGroupSize) + "; choose another device");
    }
  }

  void set_arguments(cl_kernel kernel, const Step& step) {
    const std::string what = std::string("an argument of ") + name_of(step.op);
    if (step.buffers.size() != args_of(step.op).size() || step.params.size() != param_bytes(step.op)) {
      throw Error("opencl: " + what + " is missing; make steps with make_step");
    }
    cl_uint index = 0;
    for (Buffer* buffer : step.buffers) {
      const auto* mine = dynamic_cast<const ClBuffer*>(buffer);
      if (mine == nullptr || mine->context() != context_.get()) {
        throw Error("opencl: " + what + " is not a buffer of this backend");
      }
      const cl_mem memory = mine->memory();
      check(api_.clSetKernelArg(kernel, index++, sizeof memory, &memory), what);
    }
    check(api_.clSetKernelArg(kernel, index, step.params.size(), step.params.data()), what);
  }

  Api api_;
  Device device_;
  Handle<cl_context> context_;
  Handle<cl_command_queue> setup_queue_;
  Handle<cl_program> program_;
};

}  // namespace

std::vector<DeviceInfo> devices(std::string& absent_reason) {
  absent_reason.clear();
  std::vector<DeviceInfo> infos;
  try {
    const Api api = load_api();
    for (const Device& device : find_devices(api)) infos.push_back(info_of(device));
  } catch (const Error& error) {
    absent_reason = error.what();
  }
  return infos;
}

std::unique_ptr<Backend> open(const BackendOptions& options) { return std::make_unique<ClBackend>(options); }

BackendEntry entry() { return {"opencl", &devices, &open}; }

CacheInfo kernel_cache(const BackendOptions& options) {
  CacheInfo info{cache_folder(options.cache_dir), 0, 0};
  DIR* folder = info.path.empty() ? nullptr : opendir(info.path.c_str());
  if (folder == nullptr) return info;
  while (const dirent* entry = readdir(folder)) {
    const std::string file = entry->d_name;
    struct stat status = {};
    if (file.size() > 6 && file.compare(file.size() - 6, 6, ".clbin") == 0 &&
        stat((info.path + "/" + file).c_str(), &status) == 0) {
      info.entries += 1;
      info.bytes += static_cast<std::size_t>(status.st_size);
    }
  }
  closedir(folder);
  return info;
}

}  // namespace berth::opencl
