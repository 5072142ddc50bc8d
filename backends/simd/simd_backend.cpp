#include "simd_backend.hpp"

#include "cpu/cpu_backend.hpp"

namespace berth::simd_backend {

host::HostOps ops() { return cpu_backend::ops(); }

const char* target_name() { return "none"; }

}  // namespace berth::simd_backend
