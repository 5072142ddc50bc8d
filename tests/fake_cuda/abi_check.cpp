// Compares what backends/cuda/driver.hpp declares with CUDA's own header, where there is one: number and size of every
// parameter, what pointers point to, constants, the struct. Compiling it is the test.
#include <cstddef>
#include <type_traits>

#include "cuda/driver.hpp"

#define __CUDA_API_VERSION_INTERNAL  // functions under the names that the library exports, old ones too
#include <cuda.h>

namespace {

using namespace berth;

/// Passed and stored alike. Handles are pointers to structs on both sides, whatever these are called.
template <class A, class B>
constexpr bool same() {
  if constexpr (std::is_pointer_v<A> && std::is_pointer_v<B>) {
    using PointedA = std::remove_cv_t<std::remove_pointer_t<A>>;
    using PointedB = std::remove_cv_t<std::remove_pointer_t<B>>;
    if constexpr (std::is_scalar_v<PointedA> || std::is_scalar_v<PointedB>) {
      return same<PointedA, PointedB>();
    } else {
      return std::is_void_v<PointedA> == std::is_void_v<PointedB>;
    }
  } else if constexpr (std::is_pointer_v<A> || std::is_pointer_v<B>) {
    return false;
  } else {
    return sizeof(A) == sizeof(B) && std::is_floating_point_v<A> == std::is_floating_point_v<B>;
  }
}

template <class Mine, class Theirs>
struct Signature : std::false_type {};
template <class R, class... A, class S, class... B>
struct Signature<R (*)(A...), S (*)(B...)> {
  static constexpr bool check() {
    if constexpr (sizeof...(A) == sizeof...(B)) {
      return same<R, S>() && (same<A, B>() && ...);
    } else {
      return false;
    }
  }
};

#define X(function, parameters) \
  static_assert(Signature<decltype(cuda::Api::function), decltype(&::function)>::check(), #function);
BERTH_CUDA_FUNCTIONS(X)
BERTH_CUDA_GRAPH_FUNCTIONS(X)
BERTH_CUDA_RENAMED_FUNCTIONS(X)
#undef X

static_assert(cuda::kSuccess == CUDA_SUCCESS);
static_assert(cuda::kOutOfMemory == CUDA_ERROR_OUT_OF_MEMORY);
static_assert(cuda::kNoDevice == CUDA_ERROR_NO_DEVICE);
static_assert(cuda::kAttributeComputeCapabilityMajor == CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR);
static_assert(cuda::kAttributeComputeCapabilityMinor == CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR);
static_assert(cuda::kJitErrorLogBuffer == CU_JIT_ERROR_LOG_BUFFER);
static_assert(cuda::kJitErrorLogBufferBytes == CU_JIT_ERROR_LOG_BUFFER_SIZE_BYTES);
static_assert(cuda::kStreamNonBlocking == CU_STREAM_NON_BLOCKING);
static_assert(cuda::kEventDisableTiming == CU_EVENT_DISABLE_TIMING);
static_assert(cuda::kEventTiming == CU_EVENT_DEFAULT);

using Node = CUDA_KERNEL_NODE_PARAMS_v1;
static_assert(sizeof(cuda::KernelNodeParams) == sizeof(Node));
static_assert(offsetof(cuda::KernelNodeParams, function) == offsetof(Node, func));
static_assert(offsetof(cuda::KernelNodeParams, grid_x) == offsetof(Node, gridDimX));
static_assert(offsetof(cuda::KernelNodeParams, grid_z) == offsetof(Node, gridDimZ));
static_assert(offsetof(cuda::KernelNodeParams, block_x) == offsetof(Node, blockDimX));
static_assert(offsetof(cuda::KernelNodeParams, block_z) == offsetof(Node, blockDimZ));
static_assert(offsetof(cuda::KernelNodeParams, shared_bytes) == offsetof(Node, sharedMemBytes));
static_assert(offsetof(cuda::KernelNodeParams, kernel_params) == offsetof(Node, kernelParams));
static_assert(offsetof(cuda::KernelNodeParams, extra) == offsetof(Node, extra));

}  // namespace
