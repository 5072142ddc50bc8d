// Gives every run end its one successor, so that run ends become closed, ordered contours with black on the right:
// up along the left side of black, down along its right side. Black is connected over edges, not over corners.
//   A start goes up to the start of the first run above that touches its own. Where an earlier run of its row touches
//   that one too, it goes to that run's end instead (the top of a notch); where no run does, to its own end (a top).
//   An end goes down likewise, to the end of the last run below that touches its own.
// Every node is written once, by the item that owns its word: no order of arrival, no atomics.
// Source: the run-length contours of Chang, Chen & Lu 2004, turned from tracing into local successors.
KERNEL(run_link)
IN(0, u32, bits)  // [height, row_words]
IN(1, u32, offsets)
IN(2, u32, cracks)  // [capacity]
OUT(3, u32, nodes)  // [capacity]
PARAMS(run_link)
BODY
  EACH_ITEM
    if (GID < p.height * p.row_words) {
      const int y = GID / p.row_words;
      const int word_x = GID % p.row_words;
      const u32 row_end = RUN_ENDS_BEFORE((y + 1) * p.row_words);
      if (row_end <= U32(p.capacity)) {
        const u32 row_begin = RUN_ENDS_BEFORE(y * p.row_words);
        const bool has_below =
            y + 1 < p.height && RUN_ENDS_BEFORE(min(y + 2, p.height) * p.row_words) <= U32(p.capacity);
        const u32 word_begin = RUN_ENDS_BEFORE(GID);
        const u32 word_end =
            word_begin + POPCOUNT(RUN_EDGES(y, word_x)) + (word_x == p.row_words - 1 ? bits[GID] >> 31 : 0u);
        // The cracks of this word lie over the same words above and below.
        const u32 above_begin = y > 0 ? RUN_ENDS_BEFORE(GID - p.row_words) : 0u;
        const u32 above_edges = y > 0 ? RUN_EDGES(y - 1, word_x) : 0u;
        const u32 below_begin = has_below ? RUN_ENDS_BEFORE(GID + p.row_words) : 0u;
        const u32 below_edges = has_below ? RUN_EDGES(y + 1, word_x) : 0u;
        for (u32 id = word_begin; id < word_end; id += 1u) {
          const u32 x = cracks[id];
          const int pixel = S32(x) - word_x * 32;  // 32 where the row ends black
          // The run's other end. Not id + 1u and id - 1u where an end is told from a start: LLVM 18, as PoCL has it in
          // Debian 13, then loads another with AVX-512 (llvm-project, issue 81872).
          const u32 mate = id ^ 1u;
          u32 next = mate;
          if ((id & 1u) == 0u) {
            if (y > 0) {
              const u32 after = above_begin + POPCOUNT(above_edges & bits_below(pixel + 1));
              if ((after & 1u) != 0u) {  // the pixel above is black: its run began at after - 1
                next = id > row_begin && cracks[id - 1u] > cracks[after - 1u] ? id - 1u : after - 1u;
              } else if (after < row_begin && cracks[after] < cracks[mate]) {
                next = after;
              }
            }
          } else if (has_below) {
            const u32 after = below_begin + POPCOUNT(below_edges & bits_below(pixel));  // past the run's last pixel
            if ((after & 1u) != 0u) {
              next = id + 1u < row_end && cracks[id + 1u] < cracks[after] ? id + 1u : after;
            } else if (after > row_end && cracks[after - 1u] > cracks[mate]) {
              next = after - 1u;
            }
          }
          nodes[id] = make_node(x, S32(next) - S32(id));
        }
      }
    }
  EACH_END
END
