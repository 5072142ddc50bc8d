// Walks every contour once from its first top and keeps those that may be a quadrilateral.
// A top of an outline is a start whose successor is its own end, a top of a hole one whose successor is the end before
// it. Every contour has its topmost row's leftmost top; an item per run walks from its top and gives up on meeting an
// earlier one of the same kind or a higher row, so that exactly one item finishes a contour.
// A convex outline crosses each of its rows and columns twice; with a quarter to spare for noise:
//   nodes <= 2.5 height + 4, horizontal length <= 2.5 width + 4; a walk longer than any that could pass is stopped.
// The area's sign tells outlines from holes.
KERNEL(contour_measure)
IN(0, u32, nodes)  // [capacity]
IN(1, u32, offsets)
OUT(2, u32, spans)  // [totals_at]: nodes of the contour that the run begins, CONTOUR_HOLE set for holes, 0 for none;
                    // then contours and points of each group: [groups], one unused, [groups]
PARAMS(contour_measure)
STRIDE_IF(p.max_side < 1600 || p.height < 1600)  // 16 walks of at most 4004 nodes
SHARED(u32, contours, 1)
SHARED(u32, points, 1)
SHARED(int, node_count, 1)
BODY
  FIRST_ITEMS(1) {
    contours[0] = 0u;
    points[0] = 0u;
    // Nodes exist for whole rows within the capacity: all of them, or the last row's begin that does not pass it.
    int low = RUN_ENDS_BEFORE(p.height * p.row_words) <= U32(p.capacity) ? p.height : 0;
    int high = p.height + 1;
    while (high - low > 1) {
      const int middle = (low + high) / 2;
      if (RUN_ENDS_BEFORE(middle * p.row_words) <= U32(p.capacity)) {
        low = middle;
      } else {
        high = middle;
      }
    }
    node_count[0] = S32(RUN_ENDS_BEFORE(low * p.row_words));
  }
  EACH_ITEM
    spans[GID] = 0u;
  EACH_END
  FIRST_ITEMS(min(node_count[0] / 2 - GROUP * GROUP_SIZE, GROUP_SIZE)) {
    const int first = GID * 2;
    const int top = node_step(nodes[first]);  // 1: of an outline, -1: of a hole
    if ((top == 1 && p.want_outer != 0) || (top == -1 && p.want_holes != 0)) {
      const int first_x = node_x(nodes[first]);
      const int most_nodes = min(p.max_side, p.height) * 5 / 2 + 4;
      int id = first;
      int y = 0;
      int count = 0;
      int area = 0;
      int horizontal = 0;
      int x_before = first_x;
      int x_min = first_x;
      int x_max = first_x;
      int y_max = 0;
      bool walking = true;
      while (walking) {
        const u32 node = nodes[id];
        const int x = node_x(node);
        const int step = node_step(node);
        x_min = min(x_min, x);
        x_max = max(x_max, x);
        y_max = max(y_max, y);
        area += (id & 1) != 0 ? x : -x;
        horizontal += x < x_before ? x_before - x : x - x_before;
        x_before = x;
        count += 1;
        const bool earlier = id < first && (id & 1) == 0 && step == top;
        y += node_descent(id, step);
        id += step;
        if (earlier || y < 0 || count > most_nodes) {
          count = 0;
          walking = false;
        } else if (id == first) {
          walking = false;
        }
      }
      horizontal += x_before < first_x ? first_x - x_before : x_before - first_x;
      const int width = x_max - x_min;
      const int height = y_max + 1;
      const int signed_area = area * top;
      if (count > 0 && signed_area >= p.min_area && min(width, height) >= p.min_side &&
          max(width, height) <= p.max_side && count <= height * 5 / 2 + 4 && horizontal <= width * 5 / 2 + 4) {
        spans[GID] = U32(count) | (top < 0 ? CONTOUR_HOLE : 0u);
        ATOMIC_ADD(contours[0], 1u);
        ATOMIC_ADD(points[0], U32(count));
      }
    }
  }
  BARRIER;
  FIRST_ITEMS(1) {
    spans[p.totals_at + GROUP] = contours[0];
    spans[p.totals_at + p.groups + 1 + GROUP] = points[0];
  }
  BARRIER;
END
