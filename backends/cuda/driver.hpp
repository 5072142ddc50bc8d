#pragma once

#include <cstddef>
#include <string>

/// What Berth uses of the CUDA driver API, declared here so that building needs no CUDA headers and running no CUDA
/// runtime. These are the documented functions of cuda.h under the names libcuda.so.1 exports; a versioned name (_v2)
/// stands for one signature for good, so drivers from CUDA 10.2 to today's run the same program.
/// tests/fake_cuda/abi_check.cpp compares every declaration with cuda.h where there is one.
namespace berth::cuda {

using CUresult = int;  // an enum there
using CUdevice = int;
using CUdeviceptr = unsigned long long;
using CUcontext = struct CUctx_st*;
using CUmodule = struct CUmod_st*;
using CUfunction = struct CUfunc_st*;
using CUstream = struct CUstream_st*;
using CUevent = struct CUevent_st*;
using CUgraph = struct CUgraph_st*;
using CUgraphNode = struct CUgraphNode_st*;
using CUgraphExec = struct CUgraphExec_st*;

/// CUDA_KERNEL_NODE_PARAMS_v1, which cuGraphAddKernelNode without a suffix takes.
struct KernelNodeParams {
  CUfunction function;
  unsigned grid_x, grid_y, grid_z;
  unsigned block_x, block_y, block_z;
  unsigned shared_bytes;
  void** kernel_params;
  void** extra;
};

constexpr CUresult kSuccess = 0;
constexpr CUresult kOutOfMemory = 2;
constexpr CUresult kNoDevice = 100;

constexpr int kAttributeComputeCapabilityMajor = 75;
constexpr int kAttributeComputeCapabilityMinor = 76;
constexpr int kJitErrorLogBuffer = 5;
constexpr int kJitErrorLogBufferBytes = 6;
constexpr unsigned kStreamNonBlocking = 1;
constexpr unsigned kEventDisableTiming = 2;
constexpr unsigned kEventTiming = 0;

/// X(name, parameters): what every driver since CUDA 10.2 has.
#define BERTH_CUDA_FUNCTIONS(X)                                                                                  \
  X(cuInit, (unsigned flags))                                                                                    \
  X(cuDriverGetVersion, (int* version))                                                                          \
  X(cuGetErrorName, (CUresult error, const char** name))                                                         \
  X(cuDeviceGetCount, (int* count))                                                                              \
  X(cuDeviceGet, (CUdevice * device, int ordinal))                                                               \
  X(cuDeviceGetName, (char* name, int bytes, CUdevice device))                                                   \
  X(cuDeviceGetAttribute, (int* value, int attribute, CUdevice device))                                          \
  X(cuDevicePrimaryCtxRetain, (CUcontext * context, CUdevice device))                                            \
  X(cuCtxPushCurrent_v2, (CUcontext context))                                                                    \
  X(cuCtxPopCurrent_v2, (CUcontext * context))                                                                   \
  X(cuModuleLoadDataEx, (CUmodule * module, const void* image, unsigned count, int* options, void** values))     \
  X(cuModuleUnload, (CUmodule module))                                                                           \
  X(cuModuleGetFunction, (CUfunction * function, CUmodule module, const char* name))                             \
  X(cuMemAlloc_v2, (CUdeviceptr * memory, std::size_t bytes))                                                    \
  X(cuMemFree_v2, (CUdeviceptr memory))                                                                          \
  X(cuMemHostAlloc, (void** memory, std::size_t bytes, unsigned flags))                                          \
  X(cuMemFreeHost, (void* memory))                                                                               \
  X(cuMemsetD8Async, (CUdeviceptr memory, unsigned char value, std::size_t bytes, CUstream stream))              \
  X(cuMemcpyHtoDAsync_v2, (CUdeviceptr to, const void* from, std::size_t bytes, CUstream stream))                \
  X(cuMemcpyDtoHAsync_v2, (void* to, CUdeviceptr from, std::size_t bytes, CUstream stream))                      \
  X(cuStreamCreate, (CUstream * stream, unsigned flags))                                                         \
  X(cuStreamSynchronize, (CUstream stream))                                                                      \
  X(cuStreamDestroy_v2, (CUstream stream))                                                                       \
  X(cuEventCreate, (CUevent * event, unsigned flags))                                                            \
  X(cuEventRecord, (CUevent event, CUstream stream))                                                             \
  X(cuEventSynchronize, (CUevent event))                                                                         \
  X(cuEventDestroy_v2, (CUevent event))                                                                          \
  X(cuLaunchKernel,                                                                                              \
    (CUfunction function, unsigned grid_x, unsigned grid_y, unsigned grid_z, unsigned block_x, unsigned block_y, \
     unsigned block_z, unsigned shared_bytes, CUstream stream, void** kernel_params, void** extra))

/// Graphs: all of them, or plans are launched step by step.
#define BERTH_CUDA_GRAPH_FUNCTIONS(X)                                                                             \
  X(cuGraphCreate, (CUgraph * graph, unsigned flags))                                                             \
  X(cuGraphAddKernelNode, (CUgraphNode * node, CUgraph graph, const CUgraphNode* dependencies, std::size_t count, \
                           const KernelNodeParams* params))                                                       \
  X(cuGraphLaunch, (CUgraphExec exec, CUstream stream))                                                           \
  X(cuGraphExecDestroy, (CUgraphExec exec))                                                                       \
  X(cuGraphDestroy, (CUgraph graph))

/// Functions that were renamed: the first one of a group that the driver has is called.
#define BERTH_CUDA_RENAMED_FUNCTIONS(X)                                                                            \
  X(cuEventElapsedTime_v2, (float* ms, CUevent from, CUevent to))                                                  \
  X(cuEventElapsedTime, (float* ms, CUevent from, CUevent to))                                                     \
  X(cuDevicePrimaryCtxRelease_v2, (CUdevice device))                                                               \
  X(cuDevicePrimaryCtxRelease, (CUdevice device))                                                                  \
  X(cuGraphInstantiateWithFlags, (CUgraphExec * exec, CUgraph graph, unsigned long long flags))                    \
  X(cuGraphInstantiate_v2, (CUgraphExec * exec, CUgraph graph, CUgraphNode * error, char* log, std::size_t bytes)) \
  X(cuGraphInstantiate, (CUgraphExec * exec, CUgraph graph, CUgraphNode * error, char* log, std::size_t bytes))

/// Pointers into the driver's library, which stays open until the process ends: drivers have threads of their own.
struct Api {
#define X(function, parameters) CUresult(*function) parameters = nullptr;
  BERTH_CUDA_FUNCTIONS(X)
  BERTH_CUDA_GRAPH_FUNCTIONS(X)
  BERTH_CUDA_RENAMED_FUNCTIONS(X)
#undef X
  int version = 0;  // of CUDA that the driver supports: 1000 * major + 10 * minor
  bool has_graphs = false;

  CUresult release_primary_context(CUdevice device) const;
  CUresult elapsed(float* ms, CUevent from, CUevent to) const;
  CUresult instantiate(CUgraphExec* exec, CUgraph graph) const;
};

/// Opens $BERTH_CUDA_LIBRARY, or libcuda.so.1, or libcuda.so, and initialises the driver. Throws Error with the reason
/// and the remedy: no driver, no device, too old a driver.
Api load_api();

/// "2 CUDA_ERROR_OUT_OF_MEMORY"
std::string describe_status(const Api& api, CUresult status);

/// Throws Error("cuda: WHAT failed (STATUS)") unless the status is kSuccess.
void check(const Api& api, CUresult status, const std::string& what);

/// "12.4" for 12040.
std::string version_text(int version);

}  // namespace berth::cuda
