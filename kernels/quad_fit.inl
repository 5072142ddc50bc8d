// Four corners for a contour, and the line of each side; a work-group a contour.
//   1. The point farthest from the bounding box's centre, and the point farthest from that one.
//   2. Twice: of the arcs so far, the one whose points lie farthest from its chord is split there.
//   3. Judged: the polygon's area against the contour's, each side's length, each arc's height over its chord. What
//      fails is polished once (three rounds of moving each vertex to the point farthest from its neighbours' chord).
//   4. Each side's line by least squares along its dominant axis, an eighth trimmed off both ends.
// Ties go to the first point in walking order. Points are half pixels (contour_trace); heights q4 of half pixels.
// Bounds: extents <= 16000 px, so differences of points are below 2^15 and cross products below 2^31.
#define POINT_X(i) S32(points[start + (i) % count] & 0xffffu)
#define POINT_Y(i) S32((points[start + (i) % count] >> 16) | 1u)

FN u32 square_distance(int dx, int dy) { return U32(dx * dx + dy * dy); }
FN u32 chord_distance(int chord_x, int chord_y, int dx, int dy) {
  const int cross = chord_x * dy - chord_y * dx;
  return U32(cross < 0 ? -cross : cross);
}
// Height of an arc over its chord, from the greatest cross product. Bound: length < 2^16.
FN u32 arc_height_q4(u32 cross, u32 length) {
  const u32 safe = max(length, 1u);
  return cross / safe * 16u + cross % safe * 16u / safe;
}

// Words of `state`.
#define VERTEX 0     /* 5: indices of the vertices in walking order; the last is the first one turn on */
#define FAR 5        /* 4: index of the point farthest from each arc's chord */
#define HEIGHT 9     /* 4: that point's height */
#define BEST_VALUE 13
#define BEST_INDEX 14
#define ARC_FROM 15  /* what FIND_FARTHEST measures: the arc's ends, or the one point to be far from */
#define ARC_TO 16
#define VERTICES 17  /* how many there are */
#define SPLIT 18     /* the arc split last */
#define ALIVE 19     /* still a candidate */
#define GOOD 20      /* passed the checks */
#define X_MIN 21
#define X_MAX 22
#define Y_MIN 23
#define Y_MAX 24
#define AREA 25
#define STATE_WORDS 26

// The first i in [from, to) with the greatest value of `expression` (of i), as BEST_VALUE and BEST_INDEX (-1: all 0).
#define FIND_FARTHEST(from, to, expression)                                      \
  EACH_ITEM                                                                      \
    u32 item_best = 0u;                                                          \
    int item_at = -1;                                                            \
    for (int i = (from) + LID; i < (to); i += GROUP_SIZE) {                      \
      const u32 value = expression;                                              \
      if (value > item_best) {                                                   \
        item_best = value;                                                       \
        item_at = i;                                                             \
      }                                                                          \
    }                                                                            \
    values[LID] = item_best;                                                     \
    places[LID] = item_at;                                                       \
    ATOMIC_MAX(best[0], item_best);                                              \
  EACH_END                                                                       \
  EACH_ITEM                                                                      \
    if (places[LID] >= 0 && values[LID] == best[0]) ATOMIC_MIN(nearest[0], places[LID]); \
  EACH_END                                                                       \
  EACH_ITEM                                                                      \
    if (LID == 0) {                                                              \
      state[BEST_VALUE] = S32(best[0]);                                          \
      state[BEST_INDEX] = best[0] == 0u ? -1 : nearest[0];                       \
      best[0] = 0u;                                                              \
      nearest[0] = 0x7fffffff;                                                   \
    }                                                                            \
  EACH_END

// Point i's distance to the chord of the arc, times the chord's length.
#define FROM_CHORD                                                                                              \
  chord_distance(POINT_X(state[ARC_TO]) - POINT_X(state[ARC_FROM]), POINT_Y(state[ARC_TO]) - POINT_Y(state[ARC_FROM]), \
                 POINT_X(i) - POINT_X(state[ARC_FROM]), POINT_Y(i) - POINT_Y(state[ARC_FROM]))

// Measures arc k into FAR and HEIGHT.
#define MEASURE_ARC(k)                                                                                         \
  EACH_ITEM                                                                                                    \
    if (LID == 0) {                                                                                            \
      state[ARC_FROM] = state[VERTEX + (k)];                                                                   \
      state[ARC_TO] = state[VERTEX + (k) + 1];                                                                 \
    }                                                                                                          \
  EACH_END                                                                                                     \
  FIND_FARTHEST(state[ARC_FROM] + 1, state[ARC_TO], FROM_CHORD)                                                \
  EACH_ITEM                                                                                                    \
    if (LID == 0) {                                                                                            \
      const int chord_x = POINT_X(state[ARC_TO]) - POINT_X(state[ARC_FROM]);                                   \
      const int chord_y = POINT_Y(state[ARC_TO]) - POINT_Y(state[ARC_FROM]);                                   \
      state[FAR + (k)] = state[BEST_INDEX];                                                                    \
      state[HEIGHT + (k)] =                                                                                    \
          S32(arc_height_q4(U32(state[BEST_VALUE]), square_root(square_distance(chord_x, chord_y))));          \
    }                                                                                                          \
  EACH_END

KERNEL(quad_fit)
IN(0, u32, contours)
IN(1, u32, points)
OUT(2, s32, quads)    // [max_contours, QUAD_WORDS]: see ops.h; only the flags are written where there is none
PARAMS(quad_fit)
SHARED(int, state, STATE_WORDS)
SHARED(u32, values, 128)
SHARED(int, places, 128)
SHARED(u32, best, 1)
SHARED(int, nearest, 1)
SHARED(int, sums, 20)
BODY
  const int record = CONTOUR_HEADER + GROUP * CONTOUR_WORDS;
  const int count = GROUP < p.max_contours ? S32(contours[record + 1] & ~CONTOUR_HOLE) : 0;
  const int start = count > 0 ? S32(contours[record + 3]) : 0;
  const int turn = count > 0 && (contours[record + 1] & CONTOUR_HOLE) != 0u ? -1 : 1;
  const int quad = GROUP * QUAD_WORDS;
  if (count >= 8) {
    EACH_ITEM
      if (LID < 20) sums[LID] = 0;
      if (LID == 0) {
        best[0] = 0u;
        nearest[0] = 0x7fffffff;
        state[X_MIN] = 0x7fffffff;
        state[X_MAX] = 0;
        state[Y_MIN] = 0x7fffffff;
        state[Y_MAX] = 0;
        state[AREA] = 0;
        state[ALIVE] = 1;
        state[GOOD] = 0;
      }
    EACH_END
    EACH_ITEM
      int x_min = 0x7fffffff;
      int x_max = 0;
      int y_min = 0x7fffffff;
      int y_max = 0;
      int area = 0;
      for (int i = LID; i < count; i += GROUP_SIZE) {
        const int x = POINT_X(i);
        const int y = POINT_Y(i);
        x_min = min(x_min, x);
        x_max = max(x_max, x);
        y_min = min(y_min, y);
        y_max = max(y_max, y);
        area += ((points[start + i] >> 16) & 1u) != 0u ? x / 2 : -(x / 2);
      }
      ATOMIC_MIN(state[X_MIN], x_min);
      ATOMIC_MAX(state[X_MAX], x_max);
      ATOMIC_MIN(state[Y_MIN], y_min);
      ATOMIC_MAX(state[Y_MAX], y_max);
      ATOMIC_ADD(state[AREA], area);
    EACH_END
    FIND_FARTHEST(0, count, square_distance(POINT_X(i) - (state[X_MIN] + state[X_MAX]) / 2,
                                            POINT_Y(i) - (state[Y_MIN] + state[Y_MAX]) / 2))
    EACH_ITEM
      if (LID == 0) state[ARC_FROM] = max(state[BEST_INDEX], 0);
    EACH_END
    FIND_FARTHEST(0, count, square_distance(POINT_X(i) - POINT_X(state[ARC_FROM]),
                                            POINT_Y(i) - POINT_Y(state[ARC_FROM])))
    EACH_ITEM
      if (LID == 0) {
        const int other = max(state[BEST_INDEX], 0);
        const int first = state[ARC_FROM];
        state[VERTEX] = min(first, other);
        state[VERTEX + 1] = max(first, other);
        state[VERTEX + 2] = state[VERTEX] + count;
        state[VERTICES] = 2;
        if (first == other) state[ALIVE] = 0;
      }
    EACH_END
    MEASURE_ARC(0)
    MEASURE_ARC(1)
    for (int round = 0; round < 2; ++round) {
      EACH_ITEM
        if (LID == 0) {
          int split = 0;
          for (int k = 1; k < state[VERTICES]; ++k) {
            if (state[HEIGHT + k] > state[HEIGHT + split]) split = k;
          }
          state[SPLIT] = split;
          if (state[FAR + split] < 0) {
            state[ALIVE] = 0;
            state[FAR + split] = state[VERTEX + split];  // keeps the indices in order; the contour is dropped
          }
          for (int k = state[VERTICES]; k > split; --k) state[VERTEX + k + 1] = state[VERTEX + k];
          for (int k = state[VERTICES] - 1; k > split; --k) {
            state[FAR + k + 1] = state[FAR + k];
            state[HEIGHT + k + 1] = state[HEIGHT + k];
          }
          state[VERTEX + split + 1] = state[FAR + split];
          state[VERTICES] = state[VERTICES] + 1;
        }
      EACH_END
      MEASURE_ARC(state[SPLIT])
      MEASURE_ARC(state[SPLIT] + 1)
    }
    for (int attempt = 0; attempt < 2; ++attempt) {
      if (attempt == 1 && state[ALIVE] != 0 && state[GOOD] == 0) {
        for (int move = 0; move < 12; ++move) {
          EACH_ITEM
            if (LID == 0) {
              const int k = move & 3;
              // The arc from the vertex before to the vertex after, its begin in the first turn.
              const int from = k == 0 ? state[VERTEX + 3] : state[VERTEX + k - 1];
              int to = k == 3 ? state[VERTEX] : state[VERTEX + k + 1];
              if (to <= from) to += count;
              state[ARC_FROM] = from;
              state[ARC_TO] = to;
            }
          EACH_END
          FIND_FARTHEST(state[ARC_FROM] + 1, state[ARC_TO], FROM_CHORD)
          EACH_ITEM
            if (LID == 0 && state[BEST_INDEX] >= 0) state[VERTEX + (move & 3)] = state[BEST_INDEX] % count;
          EACH_END
        }
        EACH_ITEM
          if (LID == 0) {
            // Back into the first turn's order: rotate until the smallest index leads.
            for (int k = 0; k < 3; ++k) {
              if (state[VERTEX] > state[VERTEX + 1] || state[VERTEX] > state[VERTEX + 2] ||
                  state[VERTEX] > state[VERTEX + 3]) {
                const int lead = state[VERTEX];
                state[VERTEX] = state[VERTEX + 1];
                state[VERTEX + 1] = state[VERTEX + 2];
                state[VERTEX + 2] = state[VERTEX + 3];
                state[VERTEX + 3] = lead;
              }
            }
            state[VERTEX + 4] = state[VERTEX] + count;
            for (int k = 0; k < 4; ++k) {
              if (state[VERTEX + k] >= state[VERTEX + k + 1]) state[ALIVE] = 0;
            }
            if (state[ALIVE] == 0) {  // any order will do for what is dropped
              for (int k = 0; k < 5; ++k) state[VERTEX + k] = k;
            }
          }
        EACH_END
        MEASURE_ARC(0)
        MEASURE_ARC(1)
        MEASURE_ARC(2)
        MEASURE_ARC(3)
      }
      EACH_ITEM
        if (LID == 0 && state[ALIVE] != 0 && state[GOOD] == 0) {
          int good = 1;
          int polygon = 0;  // twice the area in half pixels squared
          int shortest = 0x7fffffff;
          const int x0 = POINT_X(state[VERTEX]);
          const int y0 = POINT_Y(state[VERTEX]);
          for (int k = 0; k < 4; ++k) {
            const int ax = POINT_X(state[VERTEX + k]) - x0;
            const int ay = POINT_Y(state[VERTEX + k]) - y0;
            const int bx = POINT_X(state[VERTEX + k + 1]) - x0;
            const int by = POINT_Y(state[VERTEX + k + 1]) - y0;
            polygon += ax * by - bx * ay;
            const int length = S32(square_root(square_distance(bx - ax, by - ay)));
            shortest = min(shortest, length);
            if (length < p.min_side_px * 2 || state[HEIGHT + k] > 51 + length * 4 / 5) good = 0;
          }
          const int contour = state[AREA] * turn * 8;
          const int off = polygon * turn > contour ? polygon * turn - contour : contour - polygon * turn;
          if (polygon * turn <= 0 || off > contour / 10 * 3 + (state[X_MAX] - state[X_MIN]) * 8) good = 0;
          state[GOOD] = good;
          values[0] = U32(shortest);
        }
      EACH_END
    }
    if (state[GOOD] != 0) {
      // The side's line: u along its dominant axis, v across, both about the middle of the side and halved until they
      // fit the sums' bound; sums[k * 5 …]: n, u, v, u u, u v.
      EACH_ITEM
        for (int k = 0; k < 4; ++k) {
          const int i0 = state[VERTEX + k];
          const int i1 = state[VERTEX + k + 1];
          const int dx = POINT_X(i1) - POINT_X(i0);
          const int dy = POINT_Y(i1) - POINT_Y(i0);
          const bool upright = (dy < 0 ? -dy : dy) >= (dx < 0 ? -dx : dx);
          const int u_from = upright ? POINT_Y(i0) : POINT_X(i0);
          const int u_to = upright ? POINT_Y(i1) : POINT_X(i1);
          const int low = min(u_from, u_to);
          const int length = max(u_from, u_to) - low;
          const int trim = side_trim(length);
          const int u_first = low + trim;
          const int u_last = low + length - trim;
          const int u_middle = (u_from + u_to) / 2;
          const int v_middle = upright ? (POINT_X(i0) + POINT_X(i1)) / 2 : (POINT_Y(i0) + POINT_Y(i1)) / 2;
          const int halvings = side_halvings(length);
          int n = 0;
          int sum_u = 0;
          int sum_v = 0;
          u32 sum_uu = 0u;
          u32 sum_uv = 0u;
          if (upright) {
            for (int i = i0 + LID; i <= i1; i += GROUP_SIZE) {
              if (POINT_Y(i) >= u_first && POINT_Y(i) <= u_last) {
                const int u = (POINT_Y(i) - u_middle) >> halvings;
                const int v = (POINT_X(i) - v_middle) >> halvings;
                n += 1;
                sum_u += u;
                sum_v += v;
                sum_uu += U32(u * u);
                sum_uv += U32(u * v);
              }
            }
          } else {
            for (int i = i0 + LID; i < i1; i += GROUP_SIZE) {
              // Between two nodes the walk follows a row boundary over whole pixel columns.
              const int x_from = POINT_X(i);
              const int x_to = POINT_X(i + 1);
              const u32 y_node = points[start + i % count] >> 16;
              const int v = (S32(y_node + (y_node & 1u)) - v_middle) >> halvings;
              if ((x_to > x_from) == (dx > 0)) {
                const int x_end = min(max(x_from, x_to), u_last + 1);
                for (int x = max(min(x_from, x_to), u_first) | 1; x < x_end; x += 2) {
                  const int u = (x - u_middle) >> halvings;
                  n += 1;
                  sum_u += u;
                  sum_v += v;
                  sum_uu += U32(u * u);
                  sum_uv += U32(u * v);
                }
              }
            }
          }
          ATOMIC_ADD(sums[k * 5], n);
          ATOMIC_ADD(sums[k * 5 + 1], sum_u);
          ATOMIC_ADD(sums[k * 5 + 2], sum_v);
          ATOMIC_ADD(sums[k * 5 + 3], S32(sum_uu));
          ATOMIC_ADD(sums[k * 5 + 4], S32(sum_uv));
        }
      EACH_END
      EACH_ITEM
        if (LID == 0) {
          for (int k = 0; k < 4; ++k) {
            const int n = sums[k * 5];
            if (n < 3) {
              state[GOOD] = 0;
            } else if (line_moment(n, sums[k * 5 + 1], sums[k * 5 + 1], U32(sums[k * 5 + 3])) <= 0) {
              state[GOOD] = 0;
            }
          }
        }
      EACH_END
      EACH_ITEM
        if (LID < 4 && state[GOOD] != 0) {
          const int i0 = state[VERTEX + LID];
          const int i1 = state[VERTEX + LID + 1];
          const int dx = POINT_X(i1) - POINT_X(i0);
          const int dy = POINT_Y(i1) - POINT_Y(i0);
          const bool upright = (dy < 0 ? -dy : dy) >= (dx < 0 ? -dx : dx);
          const int u_from = upright ? POINT_Y(i0) : POINT_X(i0);
          const int u_to = upright ? POINT_Y(i1) : POINT_X(i1);
          const int v_middle = upright ? (POINT_X(i0) + POINT_X(i1)) / 2 : (POINT_Y(i0) + POINT_Y(i1)) / 2;
          const int halvings = side_halvings(max(u_from, u_to) - min(u_from, u_to));
          const int n = sums[LID * 5];
          const int sum_u = sums[LID * 5 + 1];
          const int sum_v = sums[LID * 5 + 2];
          const int slope = ratio(line_moment(n, sum_u, sum_v, U32(sums[LID * 5 + 4])),
                                  line_moment(n, sum_u, sum_u, U32(sums[LID * 5 + 3])), 14, 2);
          const int side = quad + QUAD_SIDE + LID * QUAD_SIDE_WORDS;
          quads[side] = (upright ? 0 : 1) + 2 * ((u_from + u_to) / 2 + line_mean(n, sum_u) * (1 << halvings));
          quads[side + 1] = v_middle * 256 + line_value_q8(n, sum_u, sum_v, slope, 14) * (1 << halvings);
          quads[side + 2] = slope;
          quads[side + 3] = u_from;
          quads[side + 4] = u_to;
        }
        if (LID == 4 && state[GOOD] != 0) {
          quads[quad + 1] = count;
          quads[quad + 2] = state[AREA] * turn;
          quads[quad + 3] = S32(values[0]);
        }
      EACH_END
    }
    EACH_ITEM
      if (LID == 0) quads[quad] = state[GOOD] != 0 ? (turn < 0 ? QUAD_VALID | QUAD_HOLE : QUAD_VALID) : 0;
    EACH_END
  } else {
    EACH_ITEM
      if (LID == 0 && GROUP < p.max_contours) quads[quad] = 0;
    EACH_END
  }
END

#undef POINT_X
#undef POINT_Y
#undef VERTEX
#undef FAR
#undef HEIGHT
#undef BEST_VALUE
#undef BEST_INDEX
#undef ARC_FROM
#undef ARC_TO
#undef VERTICES
#undef SPLIT
#undef ALIVE
#undef GOOD
#undef X_MIN
#undef X_MAX
#undef Y_MIN
#undef Y_MAX
#undef AREA
#undef STATE_WORDS
#undef FIND_FARTHEST
#undef FROM_CHORD
#undef MEASURE_ARC
