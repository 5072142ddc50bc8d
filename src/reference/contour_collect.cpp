#include <algorithm>

#include "reference/layout.hpp"
#include "reference/reference.hpp"

namespace berth::reference {

// The kept contours in order of their first run, with the row it lies in and where their points go. The first
// max_contours stay; from the one on whose points do not fit, they have no nodes.
void contour_collect(const contour_collect_params& p, const u32* spans, const u32* offsets, u32* contours) {
  std::fill(contours + CONTOUR_HEADER, contours + CONTOUR_HEADER + p.max_contours * CONTOUR_WORDS, 0u);
  u32 needed = 0;
  u32 points = 0;
  int y = 0;
  for (int run = 0; run < p.groups * 128; ++run) {
    const u32 nodes = spans[run] & ~CONTOUR_HOLE;
    if (nodes == 0) continue;
    const u32 id = static_cast<u32>(run) * 2;
    while (run_ends_before(offsets, p.base_at, (y + 1) * p.row_words) <= id) ++y;
    if (needed < static_cast<u32>(p.max_contours)) {
      u32* record = contours + CONTOUR_HEADER + needed * CONTOUR_WORDS;
      record[0] = id;
      record[1] = points + nodes <= static_cast<u32>(p.max_points) ? spans[run] : 0u;
      record[2] = static_cast<u32>(y);
      record[3] = points;
    }
    ++needed;
    points += nodes;
  }
  contours[0] = run_ends_before(offsets, p.base_at, p.height * p.row_words);
  contours[1] = needed;
  contours[2] = points;
}

}  // namespace berth::reference
