// The OpenCL loader, but for two functions that fail or block when a test wants them to. All else is found in the
// loader, which this library is linked with.
#include <CL/cl.h>
#include <dlfcn.h>

#include <condition_variable>
#include <mutex>

namespace {

std::mutex mutex;
std::condition_variable changed;
bool is_lost = false, is_held = false;

template <class Function>
Function* real(const char* name) {
  static void* const loader = dlopen("libOpenCL.so.1", RTLD_NOW | RTLD_LOCAL);
  return reinterpret_cast<Function*>(dlsym(loader, name));
}

}  // namespace

#define EXPORTED extern "C" __attribute__((visibility("default")))

/// From now on launches fail, as on a device that has gone.
EXPORTED void failing_opencl_lose(int lost) {
  const std::lock_guard<std::mutex> lock(mutex);
  is_lost = lost != 0;
}

/// Until it is called with 0, nobody comes back from a wait.
EXPORTED void failing_opencl_hold(int held) {
  const std::lock_guard<std::mutex> lock(mutex);
  is_held = held != 0;
  changed.notify_all();
}

EXPORTED cl_int clEnqueueNDRangeKernel(cl_command_queue command_queue, cl_kernel kernel, cl_uint work_dim,
                                       const std::size_t* global_work_offset, const std::size_t* global_work_size,
                                       const std::size_t* local_work_size, cl_uint num_events_in_wait_list,
                                       const cl_event* event_wait_list, cl_event* event) {
  static auto* const enqueue = real<decltype(clEnqueueNDRangeKernel)>("clEnqueueNDRangeKernel");
  {
    const std::lock_guard<std::mutex> lock(mutex);
    if (is_lost) return CL_DEVICE_NOT_AVAILABLE;
  }
  return enqueue(command_queue, kernel, work_dim, global_work_offset, global_work_size, local_work_size,
                 num_events_in_wait_list, event_wait_list, event);
}

EXPORTED cl_int clWaitForEvents(cl_uint num_events, const cl_event* event_list) {
  static auto* const wait = real<decltype(clWaitForEvents)>("clWaitForEvents");
  {
    std::unique_lock<std::mutex> lock(mutex);
    changed.wait(lock, [] { return !is_held; });
  }
  return wait(num_events, event_list);
}
