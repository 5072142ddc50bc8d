#pragma once

#include <cstddef>
#include <vector>

#include "berth/types.hpp"

namespace berth {

#include "ops.h"  // kernels/ops.h: BERTH_OPS and one parameter struct per operation

/// Every device operation, in the order of kernels/ops.h.
enum class Op : int {
#define X(op) op,
  BERTH_OPS(X)
#undef X
};

/// Element type of a device buffer argument.
enum class Elem { unsigned32, signed32 };

/// One buffer argument of an operation, as deduced from the reference's signature.
struct Arg {
  Elem elem;
  bool read_only;
};

const char* name_of(Op op);
const std::vector<Op>& all_ops();
const std::vector<Arg>& args_of(Op op);
std::size_t param_bytes(Op op);

/// Work-items in a work-group: what Vulkan guarantees everywhere.
constexpr int kGroupSize = 128;

/// The operation whose parameter struct P is; the struct picks the operation at the call.
template <class P>
struct OpOf;
#define X(op)                           \
  template <>                           \
  struct OpOf<op##_params> {            \
    static constexpr Op value = Op::op; \
  };
BERTH_OPS(X)
#undef X

}  // namespace berth
