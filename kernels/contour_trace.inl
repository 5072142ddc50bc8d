// Writes the points of every listed contour in walking order (black on the right), in half pixels:
// x = 2 crack, y = 2 row + (1 for an end), so that y | 1 is the row's centre and y rounded up to even the row boundary
// that the walk crosses next.
KERNEL(contour_trace)
IN(0, u32, nodes)
IN(1, u32, contours)
OUT(2, u32, points)  // [max_points]: x | y << 16
PARAMS(contour_trace)
BODY
  EACH_ITEM
    if (GID < p.max_contours) {
      const int record = CONTOUR_HEADER + GID * CONTOUR_WORDS;
      const int count = S32(contours[record + 1] & ~CONTOUR_HOLE);
      const int first = S32(contours[record + 3]);
      int id = S32(contours[record]);
      int y = S32(contours[record + 2]);
      for (int i = 0; i < count; ++i) {
        const u32 node = nodes[id];
        const int step = node_step(node);
        points[first + i] = U32(node_x(node) * 2) | (U32(y * 2 + (id & 1)) << 16);
        y += node_descent(id, step);
        id += step;
      }
    }
  EACH_END
END
