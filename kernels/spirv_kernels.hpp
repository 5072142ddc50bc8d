#pragma once

#include <cstddef>

#include "berth/ops.hpp"

namespace berth {

/// One operation as a SPIR-V 1.3 module with the entry point `main`: buffer i is binding i of set 0, the parameters are
/// push constants. Compiled and validated when the program was built.
struct SpirvKernel {
  const u32* words;
  std::size_t bytes;
  /// Groups of kGroupSize items that a Vulkan work-group runs. How many there are follows the parameters as one more
  /// int.
  int groups;
  /// Whether it may run with these parameters; null where it always may.
  bool (*applies)(const void* params);
};

/// For every device; or for the vectors of a processor: a group a lane, or a group a vector. See prelude/glsl.h.
enum class SpirvForm { any, lanes, stride };
constexpr SpirvForm kSpirvForms[] = {SpirvForm::any, SpirvForm::lanes, SpirvForm::stride};

/// Without words where the operation does not have that form.
const SpirvKernel& spirv_kernel(Op op, SpirvForm form);

}  // namespace berth
