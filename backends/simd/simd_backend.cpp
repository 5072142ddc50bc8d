#include "simd_backend.hpp"

#include <hwy/highway.h>

#include "cpu/cpu_backend.hpp"
#include "reference/reference.hpp"
#include "signature.hpp"
#include "simd_ops.hpp"
#include "workspace.hpp"

namespace berth::simd_backend {

// Every operation that has row code; the kernel text does the rest.
#define BERTH_SIMD_OPS(X) \
  X(halve)                \
  X(tile_extrema)         \
  X(tile_histogram)       \
  X(normalize)            \
  X(despeckle)            \
  X(run_count)            \
  X(scan)                 \
  X(run_emit)             \
  X(contour_collect)      \
  X(contour_trace)        \
  X(edge_refine)          \
  X(normalize_window)     \
  X(max_pool)

// Those that work in the stream's Workspace.
#define BERTH_SIMD_WORKSPACE_OPS(X) \
  X(threshold)                      \
  X(run_link)                       \
  X(contour_measure)                \
  X(quad_fit)

// Those that threads share.
#define BERTH_SIMD_SHARED_OPS(X) \
  X(extract_window)              \
  X(convolve)                    \
  X(local_response_norm)         \
  X(fully_connected)

namespace {

// A part has the reference's arguments, then its bounds.
template <class Reference>
struct Parts;
template <class P, class... T>
struct Parts<void(const P&, T*...)> {
  using Function = void (*)(const P&, T*..., int, int);

  template <std::size_t... I>
  static void run(Function function, const void* params, void* const* buffers, int first, int last,
                  std::index_sequence<I...>) {
    function(*static_cast<const P*>(params), static_cast<T*>(buffers[I])..., first, last);
  }
  static void run(Function function, const void* params, void* const* buffers, int first, int last) {
    run(function, params, buffers, first, last, std::index_sequence_for<T...>{});
  }
};

// One that works in a workspace has it before the reference's arguments; it lies behind the buffers.
template <class Reference>
struct InWorkspace;
template <class P, class... T>
struct InWorkspace<void(const P&, T*...)> {
  using Function = void (*)(Workspace&, const P&, T*...);

  template <std::size_t... I>
  static void run(Function function, const void* params, void* const* buffers, std::index_sequence<I...>) {
    function(*static_cast<Workspace*>(buffers[sizeof...(T)]), *static_cast<const P*>(params),
             static_cast<T*>(buffers[I])...);
  }
  static void run(Function function, const void* params, void* const* buffers) {
    run(function, params, buffers, std::index_sequence_for<T...>{});
  }
};

}  // namespace

host::HostOps ops() {
  host::HostOps table = cpu_backend::ops();
  table.make_workspace = [] { return std::shared_ptr<void>(std::make_shared<Workspace>()); };
#define X(op)                                                                                                          \
  table.ops[static_cast<std::size_t>(Op::op)] = {                                                                      \
      [](const void* params, void* const* buffers, int, int) { signature::call(&simd_backend::op, params, buffers); }, \
      true};
  BERTH_SIMD_OPS(X)
#undef X
#define X(op)                                                                        \
  {                                                                                  \
    host::HostOp& entry = table.ops[static_cast<std::size_t>(Op::op)];               \
    entry.whole = entry.workspace = true;                                            \
    entry.run = [](const void* params, void* const* buffers, int, int) {             \
      InWorkspace<decltype(reference::op)>::run(&simd_backend::op, params, buffers); \
    };                                                                               \
  }
  BERTH_SIMD_WORKSPACE_OPS(X)
#undef X
#define X(op)                                                                                         \
  {                                                                                                   \
    host::HostOp& entry = table.ops[static_cast<std::size_t>(Op::op)];                                \
    entry.other = entry.run;                                                                          \
    entry.run = [](const void* params, void* const* buffers, int first, int last) {                   \
      Parts<decltype(reference::op)>::run(&simd_backend::op, params, buffers, first, last);           \
    };                                                                                                \
    entry.parts = [](const void* params) { return parts(*static_cast<const op##_params*>(params)); }; \
  }
  BERTH_SIMD_SHARED_OPS(X)
#undef X
  return table;
}

const char* target_name() { return hwy::TargetName(hwy::SupportedTargets() & -hwy::SupportedTargets()); }

}  // namespace berth::simd_backend
