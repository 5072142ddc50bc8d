#include "reference/reference.hpp"

namespace berth::reference {

// The contours' points in walking order: 2 x | (2 y + (1 for a run's end)) << 16.
void contour_trace(const contour_trace_params& p, const u32* nodes, const u32* contours, u32* points) {
  for (int slot = 0; slot < p.max_contours; ++slot) {
    const u32* record = contours + CONTOUR_HEADER + slot * CONTOUR_WORDS;
    u32 id = record[0];
    u32 y = record[2];
    for (u32 i = 0; i < (record[1] & ~CONTOUR_HOLE); ++i) {
      const u32 step = nodes[id] >> 16;
      const u32 is_end = id % 2;
      points[record[3] + i] = (nodes[id] & 0xffffu) * 2 | (y * 2 + is_end) << 16;
      if (step % 2 == 0) y = is_end == 1 ? y + 1 : y - 1;
      id += step < 0x8000 ? step : step - 0x10000;
    }
  }
}

}  // namespace berth::reference
