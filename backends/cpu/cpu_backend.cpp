#include "cpu_backend.hpp"

#include <utility>

#include "berth/ops.hpp"
#include "reference/reference.hpp"

namespace berth::cpu_backend {
namespace {

// GCC cannot see that the first phase fills the shared arrays.
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic push
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
namespace kernel {
// The prelude comes first.
// clang-format off
#include "prelude/cpu.h"
#include "all.inl"
// clang-format on
}  // namespace kernel
#if defined(__GNUC__) && !defined(__clang__)
#pragma GCC diagnostic pop
#endif

// The kernel text and the reference take the same buffers in the same order: the types come from the reference.
template <class Reference>
struct Groups;
template <class P, class... T>
struct Groups<void(const P&, T*...)> {
  using Kernel = void (*)(int group, T*..., const P&);

  template <std::size_t... I>
  static void run(Kernel kernel, const void* params, void* const* buffers, int first, int last,
                  std::index_sequence<I...>) {
    for (int group = first; group < last; ++group) {
      kernel(group, static_cast<T*>(buffers[I])..., *static_cast<const P*>(params));
    }
  }
  static void run(Kernel kernel, const void* params, void* const* buffers, int first, int last) {
    run(kernel, params, buffers, first, last, std::index_sequence_for<T...>{});
  }
};

}  // namespace

host::HostOps ops() {
  host::HostOps table;
#define X(op)                                                                                                         \
  table.ops[static_cast<std::size_t>(Op::op)] = {[](const void* params, void* const* buffers, int first, int last) {  \
                                                   Groups<decltype(reference::op)>::run(&kernel::op, params, buffers, \
                                                                                        first, last);                 \
                                                 },                                                                   \
                                                 false};
  BERTH_OPS(X)
#undef X
  return table;
}

}  // namespace berth::cpu_backend
