#include "simd/simd_ops.hpp"

namespace berth::simd_backend {

// A few hundred values: what helps is not paying for a group of items.
void scan(const scan_params& p, u32* values) {
  u32* const end = values + p.first + p.count;
  u32 before = 0;
  for (u32* value = values + p.first; value != end; ++value) {
    const u32 here = *value;
    *value = before;
    before += here;
  }
  *end = before;
}

}  // namespace berth::simd_backend
