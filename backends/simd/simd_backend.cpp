#include "simd_backend.hpp"

#include <hwy/highway.h>

#include "cpu/cpu_backend.hpp"
#include "signature.hpp"
#include "simd_ops.hpp"

namespace berth::simd_backend {

// Every operation that has row code; the kernel text does the rest.
#define BERTH_SIMD_OPS(X) \
  X(halve)                \
  X(tile_extrema)         \
  X(tile_histogram)       \
  X(threshold)            \
  X(despeckle)            \
  X(run_count)            \
  X(run_emit)             \
  X(run_link)             \
  X(contour_measure)      \
  X(contour_collect)      \
  X(contour_trace)        \
  X(quad_fit)             \
  X(edge_refine)

host::HostOps ops() {
  host::HostOps table = cpu_backend::ops();
#define X(op)                                                                                                          \
  table.ops[static_cast<std::size_t>(Op::op)] = {                                                                      \
      [](const void* params, void* const* buffers, int, int) { signature::call(&simd_backend::op, params, buffers); }, \
      true};
  BERTH_SIMD_OPS(X)
#undef X
  return table;
}

const char* target_name() { return hwy::TargetName(hwy::SupportedTargets() & -hwy::SupportedTargets()); }

BackendEntry entry() {
  return {"simd", [](std::string&) { return std::vector<DeviceInfo>{host::processor(target_name())}; },
          [](const BackendOptions& options) {
            host::check_device("simd", options);
            return host::make_host_backend("simd", host::processor(target_name()), ops(), options.threads);
          }};
}

}  // namespace berth::simd_backend
