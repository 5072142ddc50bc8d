#include "reference/layout.hpp"
#include "reference/reference.hpp"

namespace berth::reference {

// The cracks where the rows' bits change, in raster order, of the rows that fit whole into the capacity.
void run_emit(const run_emit_params& p, const u32* bits, const u32* offsets, u32* cracks) {
  const int kept = kept_run_ends(offsets, p.base_at, p.height, p.row_words, p.capacity);
  int id = 0;
  for (int y = 0; y < p.height; ++y) {
    bool last = false;
    for (int x = 0; x <= p.row_words * 32; ++x) {
      const bool here = x < p.row_words * 32 && bit_at(bits, p.row_words, x, y);
      if (here != last && id < kept) cracks[id++] = static_cast<u32>(x);
      last = here;
    }
  }
}

}  // namespace berth::reference
