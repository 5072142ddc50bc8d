#pragma once

#include <cstddef>

#include "berth/ops.hpp"

namespace berth {

/// One operation as a SPIR-V 1.3 module with the entry point `main`: buffer i is binding i of set 0, the parameters are
/// push constants. Compiled and validated when the program was built.
struct SpirvKernel {
  const u32* words;
  std::size_t bytes;
  /// Groups of kGroupSize items that a Vulkan work-group runs: one, with an invocation an item; or several, with an
  /// invocation a group, and the number of groups follows the parameters as one more int.
  int groups;
  /// Whether several may be run with these parameters; null where one is. See prelude/glsl.h.
  bool (*applies)(const void* params);
};

/// The kernel for every device; or the one for the lanes of a processor, without words where there is none.
const SpirvKernel& spirv_kernel(Op op, bool lanes);

}  // namespace berth
