#pragma once

#include <cstddef>

#include "berth/ops.hpp"

namespace berth {

/// One operation as a SPIR-V 1.3 module with the entry point `main`: buffer i is binding i of set 0, the parameters are
/// push constants, a work-group has kGroupSize items. Compiled and validated when the program was built.
struct SpirvKernel {
  const u32* words;
  std::size_t bytes;
};

const SpirvKernel& spirv_kernel(Op op);

}  // namespace berth
