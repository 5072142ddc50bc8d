// Four corners for a contour, and the line of each side; a work-group a contour.
// Contours within p.margin pixels of the image's border are left out.
//   1. The point farthest from the bounding box's centre, and the point farthest from that one.
//   2. Twice: of the arcs so far, the one whose points lie farthest from its chord is split there.
//   3. Judged: the polygon's area against the contour's, each side's length, each arc's height over its chord. What
//      fails is polished once (three rounds of moving each vertex to the point farthest from its neighbours' chord).
//   4. Each side's line by least squares along its dominant axis, an eighth trimmed off both ends.
// Ties go to the first point in walking order. Points are half pixels (contour_trace); heights q4 of half pixels.
// Bounds: extents <= 16000 px, so differences of points are below 2^15 and cross products below 2^31.
// Indices run on into the second turn: 0 <= i < 2 count; in the first, i - count wraps above i.
#define POINT(i) points[start + min(U32(i), U32((i)-count))]
#define POINT_X(i) S32(POINT(i) & 0xffffu)
#define POINT_Y(i) S32((POINT(i) >> 16) | 1u)

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
#define VERTEX 0    /* 5: indices of the vertices in walking order; the last is the first one turn on */
#define FAR 5       /* 4: index of the point farthest from each arc's chord, -1 when all lie on it */
#define HEIGHT 9    /* 4: that point's height */
#define VERTICES 13 /* how many there are */
#define SPLIT 14    /* the arc split last */
#define FIRST 15    /* where the next search begins and ends … */
#define LAST 16
#define FROM_X 17 /* … the point it measures from … */
#define FROM_Y 18
#define CHORD_X 19 /* … and the chord, if it is one */
#define CHORD_Y 20
#define DONE 21 /* no search is left: judged, or hopeless */
#define GOOD 22 /* passed the checks */
#define SHORTEST 23
#define SEARCH 24 /* which of the searches below it is */
#define BOX 25    /* 5: greatest 65535 - x, x, 65535 - y, y; area */
#define STATE_WORDS 30
#define X_MIN (65535 - state[BOX])
#define X_MAX state[BOX + 1]
#define Y_MIN (65535 - state[BOX + 2])
#define Y_MAX state[BOX + 3]
#define AREA state[BOX + 4]

// The searches for a farthest point, in order; after SPLITS the polygon is judged, after POLISHED once more.
#define FROM_CENTRE 0
#define FROM_FIRST 1
#define SPLITS 8    /* 2 and 3: the first two arcs; 4 … 7: both halves of the arc just split, twice */
#define POLISHED 20 /* 8 … 19: each vertex's neighbours' arc, three rounds */
#define SEARCHES 24 /* 20 … 23: the four arcs again */

KERNEL(quad_fit)
IN(0, u32, contours)
IN(1, u32, points)
OUT(2, s32, quads)  // [max_contours, QUAD_WORDS]: see ops.h; only the flags are written where there is none
PARAMS(quad_fit)
LANES_IF(p.max_height * 70 + p.max_width * 20 < 47000)  // at most 28 turns a node, 8 a column, 17500 besides
STRIDE_IF(p.max_height * 10 + p.max_width * 3 < 47000)  // an eighth of those turns a node and a column
SHARED(int, state, STATE_WORDS)
SHARED(int, work, 640)  // five words an item, or two
SHARED(int, sums, 20)
BODY
  const int record = CONTOUR_HEADER + GROUP * CONTOUR_WORDS;
  const int count = GROUP < p.max_contours ? S32(contours[record + 1] & ~CONTOUR_HOLE) : 0;
  const int start = count > 0 ? S32(contours[record + 3]) : 0;
  const int turn = count > 0 && (contours[record + 1] & CONTOUR_HOLE) != 0u ? -1 : 1;
  const int quad = GROUP * QUAD_WORDS;
  if (count >= 8) {
    // The box and the area, each item's share first; then sixteen items for each word, then one.
    EACH_ITEM
      int left = 0;
      int right = 0;
      int top = 0;
      int bottom = 0;
      int area = 0;
      for (int i = LID; i < count; i += GROUP_SIZE) {
        const int x = POINT_X(i);
        const int y = POINT_Y(i);
        left = max(left, 65535 - x);
        right = max(right, x);
        top = max(top, 65535 - y);
        bottom = max(bottom, y);
        area += ((points[start + i] >> 16) & 1u) != 0u ? x / 2 : -(x / 2);
      }
      work[LID] = left;
      work[128 + LID] = right;
      work[256 + LID] = top;
      work[384 + LID] = bottom;
      work[512 + LID] = area;
    EACH_END
    FIRST_ITEMS(80) {
      const int first = (LID >> 4) * 128 + (LID & 15);
      int all = work[first];
      for (int i = first + 16; i < first + 128; i += 16) all = LID < 64 ? max(all, work[i]) : all + work[i];
      work[first] = all;
    }
    BARRIER;
    FIRST_ITEMS(5) {
      int all = work[LID * 128];
      for (int i = LID * 128 + 1; i < LID * 128 + 16; ++i) all = LID < 4 ? max(all, work[i]) : all + work[i];
      state[BOX + LID] = all;
    }
    BARRIER;
    FIRST_ITEMS(1) {
      state[FIRST] = 0;
      state[LAST] = count;
      state[FROM_X] = (X_MIN + X_MAX) / 2;
      state[FROM_Y] = (Y_MIN + Y_MAX) / 2;
      state[SEARCH] = FROM_CENTRE;
      state[DONE] = min(X_MIN, Y_MIN) < p.margin * 2 || X_MAX > (p.max_width - p.margin) * 2 ||
                            Y_MAX > (p.max_height - p.margin) * 2
                        ? 1
                        : 0;
      state[GOOD] = 0;
    }
    BARRIER;
    // One search a turn: every item its share, sixteen items eight results each, one item the rest; that one draws the
    // conclusions and says what to search next. Compilers that unroll barriers get a single copy of it.
    while (state[DONE] == 0) {
      EACH_ITEM
        if (LID < state[LAST] - state[FIRST]) {
          u32 most = 0u;
          int at = -1;
          for (int i = state[FIRST] + LID; i < state[LAST]; i += GROUP_SIZE) {
            const u32 point = POINT(i);
            const int dx = S32(point & 0xffffu) - state[FROM_X];
            const int dy = S32((point >> 16) | 1u) - state[FROM_Y];
            const u32 far = state[SEARCH] <= FROM_FIRST ? square_distance(dx, dy)
                                                        : chord_distance(state[CHORD_X], state[CHORD_Y], dx, dy);
            if (far > most) {
              most = far;
              at = i;
            }
          }
          work[LID] = S32(most);
          work[128 + LID] = at;
        }
      EACH_END
      FIRST_ITEMS(16) {
        const int busy = min(state[LAST] - state[FIRST], GROUP_SIZE);
        if (LID + 16 < busy) {
          u32 most = U32(work[LID]);
          int at = work[128 + LID];
          for (int i = LID + 16; i < busy; i += 16) {
            const u32 far = U32(work[i]);
            if (far > most || (far == most && work[128 + i] < at)) {
              most = far;
              at = work[128 + i];
            }
          }
          work[LID] = S32(most);
          work[128 + LID] = at;
        }
      }
      BARRIER;
      FIRST_ITEMS(1) {
        const int search = state[SEARCH];
        const int rest = min(state[LAST] - state[FIRST], 16);
        u32 most = 0u;
        int at = -1;  // the first of the farthest points, -1 when all distances are 0
        for (int i = 0; i < rest; ++i) {
          const u32 far = U32(work[i]);
          if (far > most || (far == most && work[128 + i] < at)) {
            most = far;
            at = work[128 + i];
          }
        }
        if (search == FROM_CENTRE) {
          state[VERTEX] = max(at, 0);
        } else if (search == FROM_FIRST) {
          const int first = state[VERTEX];
          const int other = max(at, 0);
          state[VERTEX] = min(first, other);
          state[VERTEX + 1] = max(first, other);
          state[VERTEX + 2] = min(first, other) + count;
          state[VERTICES] = 2;
          if (first == other) state[DONE] = 1;
        } else if (search >= SPLITS && search < POLISHED) {
          if (at >= 0) state[VERTEX + (search & 3)] = at < count ? at : at - count;
        } else {
          const int k = search < 4 ? search - 2 : search < SPLITS ? state[SPLIT] + (search & 1) : search - POLISHED;
          const u32 length = square_root(square_distance(state[CHORD_X], state[CHORD_Y]));
          state[FAR + k] = at;
          state[HEIGHT + k] = S32(arc_height_q4(most, length));
        }
        if (search == 3 || search == 5) {  // split the arc with the greatest height
          int split = 0;
          for (int k = 1; k < state[VERTICES]; ++k) {
            if (state[HEIGHT + k] > state[HEIGHT + split]) split = k;
          }
          if (state[FAR + split] < 0) {
            state[DONE] = 1;
          } else {
            for (int k = state[VERTICES]; k > split; --k) state[VERTEX + k + 1] = state[VERTEX + k];
            for (int k = state[VERTICES] - 1; k > split; --k) {
              state[FAR + k + 1] = state[FAR + k];
              state[HEIGHT + k + 1] = state[HEIGHT + k];
            }
            state[VERTEX + split + 1] = state[FAR + split];
            state[VERTICES] = state[VERTICES] + 1;
            state[SPLIT] = split;
          }
        } else if (search == POLISHED - 1) {  // back into the first turn's order: rotate until the smallest leads
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
            if (state[VERTEX + k] >= state[VERTEX + k + 1]) state[DONE] = 1;
          }
        } else if (search == SPLITS - 1 || search == SEARCHES - 1) {
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
          const int contour = AREA * turn * 8;
          const int off = polygon * turn > contour ? polygon * turn - contour : contour - polygon * turn;
          if (polygon * turn <= 0 || off > contour / 10 * 3 + (X_MAX - X_MIN) * 8) good = 0;
          state[GOOD] = good;
          state[DONE] = search == SEARCHES - 1 ? 1 : good;
          state[SHORTEST] = shortest;
        }
        state[SEARCH] = search + 1;
        if (search == FROM_CENTRE) {
          state[FROM_X] = POINT_X(state[VERTEX]);
          state[FROM_Y] = POINT_Y(state[VERTEX]);
        } else if (state[DONE] == 0) {
          const int next = search + 1;
          int k = next < 4 ? next - 2 : next < SPLITS ? state[SPLIT] + (next & 1) : next & 3;
          int from = state[VERTEX + k];
          int to = state[VERTEX + k + 1];
          if (next >= SPLITS && next < POLISHED) {
            // From the vertex before to the vertex after, beginning in the first turn.
            from = state[VERTEX + ((k + 3) & 3)];
            to = state[VERTEX + ((k + 1) & 3)];
            if (to <= from) to += count;
          }
          state[FIRST] = from + 1;
          state[LAST] = to;
          state[FROM_X] = POINT_X(from);
          state[FROM_Y] = POINT_Y(from);
          state[CHORD_X] = POINT_X(to) - state[FROM_X];
          state[CHORD_Y] = POINT_Y(to) - state[FROM_Y];
        }
      }
      BARRIER;
    }
    if (state[GOOD] != 0) {
      // The side's line: u along its dominant axis, v across, both about the middle of the side and halved until they
      // fit the sums' bound. 32 items a side add up n, u, v, u u, u v; sums[k * 5 …] are the sides'.
      EACH_ITEM
        const int k = LID >> 5;
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
          for (int i = i0 + (LID & 31); i <= i1; i += 32) {
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
          for (int i = i0 + (LID & 31); i < i1; i += 32) {
            // Between two nodes the walk follows a row boundary over whole pixel columns.
            const int x_from = POINT_X(i);
            const int x_to = POINT_X(i + 1);
            const u32 y_node = POINT(i) >> 16;
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
        work[LID] = n;
        work[128 + LID] = sum_u;
        work[256 + LID] = sum_v;
        work[384 + LID] = S32(sum_uu);
        work[512 + LID] = S32(sum_uv);
      EACH_END
      FIRST_ITEMS(20) {
        const int first = LID % 5 * 128 + LID / 5 * 32;
        u32 sum = 0u;
        for (int i = first; i < first + 32; ++i) sum += U32(work[i]);
        sums[LID] = S32(sum);
      }
      BARRIER;
      FIRST_ITEMS(1) {
        for (int k = 0; k < 4; ++k) {
          const int n = sums[k * 5];
          if (n < 3) {
            state[GOOD] = 0;
          } else if (line_moment(n, sums[k * 5 + 1], sums[k * 5 + 1], U32(sums[k * 5 + 3])) <= 0) {
            state[GOOD] = 0;
          }
        }
      }
      BARRIER;
      FIRST_ITEMS(5) {
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
          quads[quad + 2] = AREA * turn;
          quads[quad + 3] = state[SHORTEST];
        }
      }
      BARRIER;
    }
    FIRST_ITEMS(1) { quads[quad] = state[GOOD] != 0 ? (turn < 0 ? QUAD_VALID | QUAD_HOLE : QUAD_VALID) : 0; }
    BARRIER;
  } else {
    FIRST_ITEMS(1) {
      if (GROUP < p.max_contours) quads[quad] = 0;
    }
    BARRIER;
  }
END

#undef POINT
#undef POINT_X
#undef POINT_Y
#undef VERTEX
#undef FAR
#undef HEIGHT
#undef VERTICES
#undef SPLIT
#undef FIRST
#undef LAST
#undef FROM_X
#undef FROM_Y
#undef CHORD_X
#undef CHORD_Y
#undef DONE
#undef GOOD
#undef SHORTEST
#undef SEARCH
#undef BOX
#undef STATE_WORDS
#undef X_MIN
#undef X_MAX
#undef Y_MIN
#undef Y_MAX
#undef AREA
#undef FROM_CENTRE
#undef FROM_FIRST
#undef SPLITS
#undef POLISHED
#undef SEARCHES
