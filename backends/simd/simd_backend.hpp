#pragma once

#include "entry.hpp"
#include "host/host_backend.hpp"

namespace berth::simd_backend {

/// Row code for the operations where it beats the kernel text (see docs/performance.md), the kernel text elsewhere.
host::HostOps ops();

/// The instruction set chosen at run time, e.g. "AVX2".
const char* target_name();

BackendEntry entry();

}  // namespace berth::simd_backend
