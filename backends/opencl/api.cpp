#include "opencl/api.hpp"

#include <dlfcn.h>

#include <cstdlib>
#include <vector>

#include "berth/error.hpp"

namespace berth::opencl {
namespace {

std::string last_dl_error() {
  const char* text = dlerror();
  return text != nullptr ? text : "unknown error";
}

void* open_loader(std::string& opened) {
  std::vector<std::string> names = {"libOpenCL.so.1", "libOpenCL.so"};
  const char* chosen = std::getenv("BERTH_OPENCL_LIBRARY");
  if (chosen != nullptr && chosen[0] != '\0') names = {chosen};
  std::string reason;
  for (const std::string& name : names) {
    // NODELETE: drivers keep threads and thread-local state, which must not lose its code.
    if (void* library = dlopen(name.c_str(), RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE)) {
      opened = name;
      return library;
    }
    if (reason.empty()) reason = last_dl_error();
  }
  if (chosen != nullptr && chosen[0] != '\0') {
    throw Error("opencl: BERTH_OPENCL_LIBRARY cannot be opened (" + reason + "); unset it or name an OpenCL library");
  }
  throw Error("opencl: no OpenCL loader (" + reason + "); apt install ocl-icd-libopencl1 and a driver, e.g. " +
              "pocl-opencl-icd for the CPU");
}

}  // namespace

Api load_api() {
  std::string name;
  void* library = open_loader(name);
  Api api;
#define X(function)                                                                            \
  api.function = reinterpret_cast<decltype(api.function)>(dlsym(library, #function));          \
  if (api.function == nullptr) {                                                               \
    throw Error("opencl: " + name + " lacks " #function " of OpenCL 1.2 (" + last_dl_error() + \
                "); use a loader for OpenCL 1.2 or later: apt install ocl-icd-libopencl1");    \
  }
  BERTH_OPENCL_FUNCTIONS(X)
#undef X
  return api;
}

std::string describe_status(cl_int status) {
  const char* name = "";
  switch (status) {
#define X(code)       \
  case code:          \
    name = " " #code; \
    break;
    X(CL_DEVICE_NOT_FOUND)
    X(CL_DEVICE_NOT_AVAILABLE)
    X(CL_COMPILER_NOT_AVAILABLE)
    X(CL_MEM_OBJECT_ALLOCATION_FAILURE)
    X(CL_OUT_OF_RESOURCES)
    X(CL_OUT_OF_HOST_MEMORY)
    X(CL_BUILD_PROGRAM_FAILURE)
    X(CL_EXEC_STATUS_ERROR_FOR_EVENTS_IN_WAIT_LIST)
    X(CL_INVALID_VALUE)
    X(CL_INVALID_DEVICE)
    X(CL_INVALID_CONTEXT)
    X(CL_INVALID_COMMAND_QUEUE)
    X(CL_INVALID_MEM_OBJECT)
    X(CL_INVALID_BINARY)
    X(CL_INVALID_BUILD_OPTIONS)
    X(CL_INVALID_PROGRAM)
    X(CL_INVALID_PROGRAM_EXECUTABLE)
    X(CL_INVALID_KERNEL_NAME)
    X(CL_INVALID_KERNEL)
    X(CL_INVALID_ARG_INDEX)
    X(CL_INVALID_ARG_VALUE)
    X(CL_INVALID_ARG_SIZE)
    X(CL_INVALID_KERNEL_ARGS)
    X(CL_INVALID_WORK_GROUP_SIZE)
    X(CL_INVALID_WORK_ITEM_SIZE)
    X(CL_INVALID_BUFFER_SIZE)
#undef X
    default:
      break;
  }
  return std::to_string(status) + name;
}

void check(cl_int status, const std::string& what) {
  if (status != CL_SUCCESS) throw Error("opencl: " + what + " failed (" + describe_status(status) + ")");
}

}  // namespace berth::opencl
