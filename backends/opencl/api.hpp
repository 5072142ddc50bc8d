#pragma once

#include <CL/cl.h>

#include <string>
#include <utility>

namespace berth::opencl {

/// The functions of OpenCL 1.2 that Berth calls.
#define BERTH_OPENCL_FUNCTIONS(X) \
  X(clGetPlatformIDs)             \
  X(clGetPlatformInfo)            \
  X(clGetDeviceIDs)               \
  X(clGetDeviceInfo)              \
  X(clCreateContext)              \
  X(clReleaseContext)             \
  X(clCreateCommandQueue)         \
  X(clReleaseCommandQueue)        \
  X(clCreateBuffer)               \
  X(clReleaseMemObject)           \
  X(clCreateProgramWithSource)    \
  X(clCreateProgramWithBinary)    \
  X(clBuildProgram)               \
  X(clGetProgramInfo)             \
  X(clGetProgramBuildInfo)        \
  X(clReleaseProgram)             \
  X(clCreateKernel)               \
  X(clSetKernelArg)               \
  X(clGetKernelWorkGroupInfo)     \
  X(clReleaseKernel)              \
  X(clEnqueueNDRangeKernel)       \
  X(clEnqueueReadBuffer)          \
  X(clEnqueueWriteBuffer)         \
  X(clEnqueueFillBuffer)          \
  X(clEnqueueMarkerWithWaitList)  \
  X(clWaitForEvents)              \
  X(clReleaseEvent)               \
  X(clFlush)                      \
  X(clFinish)

/// Pointers into the OpenCL loader, which stays open until the process ends: drivers have threads of their own.
struct Api {
#define X(function) decltype(&::function) function = nullptr;
  BERTH_OPENCL_FUNCTIONS(X)
#undef X
};

/// Opens $BERTH_OPENCL_LIBRARY, or libOpenCL.so.1, or libOpenCL.so. Throws Error with the linker's words and the
/// remedy.
Api load_api();

/// "-11 CL_BUILD_PROGRAM_FAILURE"
std::string describe_status(cl_int status);

/// Throws Error("opencl: WHAT failed (STATUS)") unless the status is CL_SUCCESS.
void check(cl_int status, const std::string& what);

/// Owns one OpenCL object.
template <class T>
class Handle {
 public:
  using Release = cl_int(CL_API_CALL*)(T);
  Handle() = default;
  Handle(T object, Release release) : object_(object), release_(release) {}
  Handle(Handle&& other) noexcept : object_(std::exchange(other.object_, nullptr)), release_(other.release_) {}
  Handle& operator=(Handle&& other) noexcept {
    std::swap(object_, other.object_);
    std::swap(release_, other.release_);
    return *this;
  }
  ~Handle() {
    if (object_ != nullptr) release_(object_);
  }
  T get() const { return object_; }

 private:
  T object_ = nullptr;
  Release release_ = nullptr;
};

}  // namespace berth::opencl
