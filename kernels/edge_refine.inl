// Moves each side's line to the gray-level edge; a work-group a quadrilateral, 32 stations a side.
// A station is a pixel row (upright sides) or column that the side crosses: the gradients around the crossing, squared
// and only those from light outside to dark inside (walking with the dark on the right), place the edge at their
// centroid. A line through the stations' offsets from the coarse line; then again without those more than 3/8 px off.
// A station looks two pixels to either side, one where the side is shorter than 16 px: the next module, and whatever
// lies beyond a narrow margin, stay out of sight.
// Offsets are q9 px, as v is. Bounds: five squared gradients times 3 * 512 stay below 2^31.
#define EDGE_NOT_SEEN 0x7fffffff

KERNEL(edge_refine)
IN(0, u32, pixels)  // [padded_height, row_words]
IN(1, u32, levels)
IN(2, s32, quads)
OUT(3, s32, edges)  // [max_contours, EDGE_WORDS]: see ops.h; nothing is written where there is no quadrilateral
PARAMS(edge_refine)
LANES_IF(true)  // 128 stations of at most six pixels
SHARED(int, offset, 128)
SHARED(int, along, 128)  // u of the station about the side's middle
BODY
  if (GROUP < p.max_contours && (quads[GROUP * QUAD_WORDS] & QUAD_VALID) != 0) {
    EACH_ITEM
      const int side = GROUP * QUAD_WORDS + QUAD_SIDE + (LID >> 5) * QUAD_SIDE_WORDS;
      const int station = LID & 31;
      const bool upright = (quads[side] & 1) == 0;
      const int u_ref = (quads[side] >> 1) * p.scale;
      const int v_ref = quads[side + 1] * p.scale;
      const int slope = quads[side + 2];
      const int u_from = quads[side + 3] * p.scale;
      const int u_to = quads[side + 4] * p.scale;
      const int low = min(u_from, u_to);
      const int length = max(u_from, u_to) - low;
      const int trim = side_trim(length);
      const int first = (low + trim) >> 1;
      const int lines = ((low + length - trim - 1) >> 1) - first + 1;
      along[LID] = EDGE_NOT_SEEN;
      offset[LID] = 0;
      if (station < lines) {
        const int line = first + (lines <= 32 ? station : station * (lines - 1) / 31);
        const int u = 2 * line + 1;
        const int v = v_ref + ((slope * (u - u_ref)) >> 6);
        const int middle = (v + 256) >> 9;
        const int reach = length < 32 ? 1 : 2;
        const int across = upright ? p.width : p.height;
        // Upright: going down the dark lies at smaller x. Level: going left it lies at smaller y.
        const int sign = upright == (u_to > u_from) ? 1 : -1;
        if (middle - reach >= 1 && middle + reach < across && line < (upright ? p.height : p.width)) {
          int weights = 0;
          int moments = 0;
          int contrast = 0;
          int before = 0;
          for (int i = middle - reach - 1; i <= middle + reach; ++i) {
            const int x = upright ? i : line;
            const int y = upright ? line : i;
            const int pixel = S32((pixels[y * p.row_words + (x >> 2)] >> (8 * (x & 3))) & 255u);
            const int gradient = (pixel - before) * sign;
            if (i >= middle - reach && gradient > 0) {
              weights += gradient * gradient;
              moments += gradient * gradient * (i * 512 - v);
              contrast += gradient;
            }
            before = pixel;
          }
          if (contrast > 0 && contrast * 2 >= S32(levels[3])) {
            along[LID] = u - (u_from + u_to) / 2;
            offset[LID] = divide_rounded(moments, weights);
          }
        }
      }
    EACH_END
    FIRST_ITEMS(4) {
      const int side = GROUP * QUAD_WORDS + QUAD_SIDE + LID * QUAD_SIDE_WORDS;
      const int edge = GROUP * EDGE_WORDS + LID * EDGE_SIDE_WORDS;
      const int u_from = quads[side + 3] * p.scale;
      const int u_to = quads[side + 4] * p.scale;
      const int halvings = side_halvings(max(u_from, u_to) - min(u_from, u_to));
      const int u_ref = (quads[side] >> 1) * p.scale;
      const int u_middle = (u_from + u_to) / 2;
      int used = 0;
      int residual = 0;
      int slope = 0;
      int mean_u = 0;
      int value = 0;
      for (int pass = 0; pass < 2; ++pass) {
        int n = 0;
        int sum_u = 0;
        int sum_v = 0;
        u32 sum_uu = 0u;
        u32 sum_uv = 0u;
        residual = 0;
        for (int i = LID * 32; i < LID * 32 + 32; ++i) {
          if (along[i] != EDGE_NOT_SEEN) {
            const int u = along[i] >> halvings;
            const int miss = pass == 0 ? 0 : offset[i] - value - ((slope * (u - mean_u)) >> 8);
            if (miss <= 192 && miss >= -192) {
              n += 1;
              sum_u += u;
              sum_v += offset[i];
              sum_uu += U32(u * u);
              sum_uv += U32(u * offset[i]);
              residual += miss < 0 ? -miss : miss;
            }
          }
        }
        const int spread = n < 3 ? 0 : line_moment(n, sum_u, sum_u, sum_uu);
        if (spread > 0) {
          used = n;
          slope = ratio(line_moment(n, sum_u, sum_v, sum_uv), spread, 8, 64);
          mean_u = line_mean(n, sum_u);
          value = (line_value_q8(n, sum_u, sum_v, slope, 8) + 128) >> 8;
          residual = residual / n;
        } else {
          used = 0;
        }
      }
      // Offsets are q9 px over half pixels (halved `halvings` times), their slope q8: q16 of half pixels over half
      // pixels, against q14 for the side's.
      const int tilt = used == 0 ? 0 : divide_rounded(slope, 4 * (1 << halvings));
      const int from_mean = ((u_ref - u_middle) >> halvings) - mean_u;
      const int at_ref = used == 0 ? 0 : divide_rounded(slope * max(-2048, min(2048, from_mean)), 256);
      edges[edge] = quads[side + 1] * p.scale + (used == 0 ? 0 : value + at_ref);
      edges[edge + 1] = quads[side + 2] + tilt;
      edges[edge + 2] = used;
      edges[edge + 3] = residual;
    }
    BARRIER;
  }
END

#undef EDGE_NOT_SEEN
