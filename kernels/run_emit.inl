// Writes every run end's crack at its id. Rows that would pass the capacity are dropped whole, with all below them.
KERNEL(run_emit)
IN(0, u32, bits)  // [height, row_words]
IN(1, u32, offsets)
OUT(2, u32, cracks)  // [capacity]
PARAMS(run_emit)
BODY
  EACH_ITEM
    if (GID < p.height * p.row_words) {
      const int y = GID / p.row_words;
      const int word_x = GID % p.row_words;
      if (RUN_ENDS_BEFORE((y + 1) * p.row_words) <= U32(p.capacity)) {
        u32 id = RUN_ENDS_BEFORE(GID);
        for (u32 edges = RUN_EDGES(y, word_x); edges != 0u; edges &= edges - 1u) {
          cracks[id] = U32(word_x * 32 + lowest_bit(edges));
          id += 1u;
        }
        if (word_x == p.row_words - 1 && (bits[GID] >> 31) != 0u) cracks[id] = U32(p.row_words * 32);
      }
    }
  EACH_END
END
