// Lists the kept contours in raster order of their first top, with the row they begin in and a place for their points.
// Past a capacity the first ones stay; slots without a contour get 0 nodes. The header tells what was needed.
KERNEL(contour_collect)
IN(0, u32, spans)
IN(1, u32, offsets)
OUT(2, u32, contours)  // [CONTOUR_HEADER + max_contours * CONTOUR_WORDS]: see ops.h
PARAMS(contour_collect)
LANES_IF(true)  // 128 items look through at most 15 rows
SHARED(u32, ranks, 128)
SHARED(u32, starts, 128)
SHARED(u32, begins, 1)  // contours that the group begins
SHARED(u32, needed, 1)  // contours in all
BODY
  FIRST_ITEMS(1) {
    begins[0] = GROUP < p.groups ? spans[p.totals_at + GROUP + 1] - spans[p.totals_at + GROUP] : 0u;
    needed[0] = spans[p.totals_at + p.groups];
  }
  BARRIER;
  // Most groups begin no contour: nothing to number.
  FIRST_ITEMS(begins[0] != 0u ? GROUP_SIZE : 0) ranks[LID] = spans[GID];
  BARRIER;
  FIRST_ITEMS(1) {
    if (begins[0] != 0u) {
      u32 rank = spans[p.totals_at + GROUP];
      u32 start = spans[p.totals_at + p.groups + 1 + GROUP];
      for (int i = 0; i < GROUP_SIZE; ++i) {
        const u32 span = ranks[i];
        ranks[i] = rank;
        starts[i] = start;
        if (span != 0u) {
          rank += 1u;
          start += span & ~CONTOUR_HOLE;
        }
      }
    }
  }
  BARRIER;
  FIRST_ITEMS(begins[0] != 0u ? GROUP_SIZE : 0) {
    const u32 span = spans[GID];
    if (span != 0u && ranks[LID] < U32(p.max_contours)) {
      const u32 id = U32(GID) * 2u;
      int low = 0;  // the row whose run ends hold id
      int high = p.height;
      while (high - low > 1) {
        const int middle = (low + high) / 2;
        if (RUN_ENDS_BEFORE(middle * p.row_words) <= id) {
          low = middle;
        } else {
          high = middle;
        }
      }
      const bool fits = starts[LID] + (span & ~CONTOUR_HOLE) <= U32(p.max_points);
      const int record = CONTOUR_HEADER + S32(ranks[LID]) * CONTOUR_WORDS;
      contours[record] = id;
      contours[record + 1] = fits ? span : 0u;
      contours[record + 2] = U32(low);
      contours[record + 3] = starts[LID];
    }
  }
  FIRST_ITEMS(min(p.max_contours - GROUP * GROUP_SIZE, GROUP_SIZE)) {
    if (GID >= S32(min(needed[0], U32(p.max_contours)))) {
      const int record = CONTOUR_HEADER + GID * CONTOUR_WORDS;
      contours[record] = 0u;
      contours[record + 1] = 0u;
      contours[record + 2] = 0u;
      contours[record + 3] = 0u;
    }
  }
  FIRST_ITEMS(1) {
    if (GROUP == 0) {
      contours[0] = RUN_ENDS_BEFORE(p.height * p.row_words);
      contours[1] = needed[0];
      contours[2] = spans[p.totals_at + p.groups + 1 + p.groups];
    }
  }
END
