// Drops black pixels that have no black neighbour left, right, above or below: noise makes many, and every one would
// cost a contour. No marker's outline contains one.
KERNEL(despeckle)
IN(0, u32, bits)    // [height, row_words]
OUT(1, u32, clean)  // [height, row_words]
PARAMS(despeckle)
BODY
  EACH_ITEM
    if (GID < p.height * p.row_words) {
      const int x = GID % p.row_words;
      const u32 here = bits[GID];
      const u32 left = (here << 1) | (x > 0 ? bits[GID - 1] >> 31 : 0u);
      const u32 right = (here >> 1) | (x < p.row_words - 1 ? bits[GID + 1] << 31 : 0u);
      const u32 above = GID >= p.row_words ? bits[GID - p.row_words] : 0u;
      const u32 below = GID + p.row_words < p.height * p.row_words ? bits[GID + p.row_words] : 0u;
      clean[GID] = here & (left | right | above | below);
    }
  EACH_END
END
