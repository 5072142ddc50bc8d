#include <vector>

#include "reference/layout.hpp"
#include "reference/reference.hpp"

namespace berth::reference {

// Successors from the overlaps of runs in neighbouring rows, taken in raster order. Unless an overlap says otherwise a
// run end is followed by the run's other end. For an overlap of a run `up` and a run `low` below it:
//   it is the first of both:           low's start goes to up's start;
//   first of low, not of up:           low's start goes to the end of the run before low;
//   first of up, not of low:           the end of the run before up goes to up's start;
//   last of both:                      up's end goes to low's end.
void run_link(const run_link_params& p, const u32* bits, const u32* offsets, const u32* cracks, u32* nodes) {
  (void)bits;
  const int kept = kept_run_ends(offsets, p.base_at, p.height, p.row_words, p.capacity);
  std::vector<int> next(static_cast<std::size_t>(kept));
  for (int id = 0; id < kept; ++id) next[static_cast<std::size_t>(id)] = id ^ 1;
  const auto row_begin = [&](int y) {
    const int begin = static_cast<int>(run_ends_before(offsets, p.base_at, y * p.row_words));
    return begin < kept ? begin : kept;
  };
  const auto overlap = [&](int a, int b) { return cracks[a] < cracks[b + 1] && cracks[b] < cracks[a + 1]; };
  for (int y = 0; y + 1 < p.height; ++y) {
    const int up_begin = row_begin(y);
    const int low_begin = row_begin(y + 1);
    const int low_end = row_begin(y + 2);
    int first = low_begin;  // runs below that end before `up` begins touch no later run above either
    for (int up = up_begin; up < low_begin; up += 2) {
      while (first < low_end && cracks[first + 1] <= cracks[up]) first += 2;
      for (int low = first; low < low_end && cracks[low] < cracks[up + 1]; low += 2) {
        const bool first_of_low = up == up_begin || !overlap(up - 2, low);
        const bool first_of_up = low == low_begin || !overlap(up, low - 2);
        const bool last_of_low = up + 2 >= low_begin || !overlap(up + 2, low);
        const bool last_of_up = low + 2 >= low_end || !overlap(up, low + 2);
        if (first_of_low && first_of_up) {
          next[static_cast<std::size_t>(low)] = up;
        } else if (first_of_low) {
          next[static_cast<std::size_t>(low)] = low - 1;
        } else {
          next[static_cast<std::size_t>(up - 1)] = up;
        }
        if (last_of_low && last_of_up) next[static_cast<std::size_t>(up + 1)] = low + 1;
      }
    }
  }
  for (int id = 0; id < kept; ++id) {
    const u32 step = static_cast<u32>(next[static_cast<std::size_t>(id)] - id) & 0xffffu;
    nodes[id] = cracks[id] | (step << 16);
  }
}

}  // namespace berth::reference
