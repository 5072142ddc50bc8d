// Adaptive threshold. Around each tile, over 3 × 3 tiles (fewer at the border), a level between the darkest and the
// lightest pixel (the cut, q8: 128 is the middle) parts black from white; where they differ by less than the contrast,
// a pixel is neither ("don't care") and, like white, not set. An item makes 32 × 4 pixels: a word of each of four rows.
// Source: the tile threshold of AprilTag 3 (Wang & Olson 2016); SWAR per Warren, Hacker's Delight.
KERNEL(threshold)
IN(0, u32, pixels)  // [tile_rows * 4, row_words * 8]
IN(1, u32, minima)  // [tile_rows, row_words * 2]
IN(2, u32, maxima)
IN(3, u32, levels)  // [4]
OUT(4, u32, bits)   // [height, row_words]
PARAMS(threshold)
BODY
  EACH_ITEM
    if (GID < p.tile_rows * p.row_words) {
      const int tile_y = GID / p.row_words;
      const int word_x = GID % p.row_words;
      const int stride = p.row_words * 2;
      const int above = max(tile_y - 1, 0) * stride;
      const int here = tile_y * stride;
      const int below = min(tile_y + 1, p.tile_rows - 1) * stride;
      const u32 contrast = levels[3] * 0x01010101u;
      u32 row0 = 0u;
      u32 row1 = 0u;
      u32 row2 = 0u;
      u32 row3 = 0u;
      // Columns first: the extrema of three tiles, for the item's two tile words (a, b) and their neighbours.
      const int a = word_x * 2;
      const int b = a + 1;
      const int left = max(a - 1, 0);
      const int right = min(b + 1, stride - 1);
      const u32 low_a = bytes_min(bytes_min(minima[above + a], minima[here + a]), minima[below + a]);
      const u32 low_b = bytes_min(bytes_min(minima[above + b], minima[here + b]), minima[below + b]);
      const u32 high_a = bytes_max(bytes_max(maxima[above + a], maxima[here + a]), maxima[below + a]);
      const u32 high_b = bytes_max(bytes_max(maxima[above + b], maxima[here + b]), maxima[below + b]);
      u32 low_left = bytes_min(bytes_min(minima[above + left], minima[here + left]), minima[below + left]) >> 24;
      u32 high_left = bytes_max(bytes_max(maxima[above + left], maxima[here + left]), maxima[below + left]) >> 24;
      u32 low_right = bytes_min(bytes_min(minima[above + right], minima[here + right]), minima[below + right]) << 24;
      u32 high_right = bytes_max(bytes_max(maxima[above + right], maxima[here + right]), maxima[below + right]) << 24;
      if (left == a) {  // at the border the outermost tile stands in for the missing one
        low_left = low_a & 255u;
        high_left = high_a & 255u;
      }
      if (right == b) {
        low_right = low_b & 0xff000000u;
        high_right = high_b & 0xff000000u;
      }
      for (int side = 0; side < 2; ++side) {
        u32 low = side == 0 ? low_a : low_b;
        u32 high = side == 0 ? high_a : high_b;
        low = bytes_min(low, bytes_min((low << 8) | (side == 0 ? low_left : low_a >> 24),
                                       (low >> 8) | (side == 0 ? low_b << 24 : low_right)));
        high = bytes_max(high, bytes_max((high << 8) | (side == 0 ? high_left : high_a >> 24),
                                         (high >> 8) | (side == 0 ? high_b << 24 : high_right)));
        const u32 range = high - low;  // per byte: high >= low, no borrow
        const u32 judged = bytes_ge(range, contrast) * 255u;
        const u32 even = ((range & 0x00ff00ffu) * U32(p.cut) >> 8) & 0x00ff00ffu;
        const u32 odd = ((range >> 8) & 0x00ff00ffu) * U32(p.cut) & 0xff00ff00u;
        const u32 limits = low + (even | odd);  // at most high: no carry
        const int first = tile_y * 4 * p.row_words * 8 + (a + side) * 4;
        for (int k = 0; k < 4; ++k) {
          if (((judged >> (8 * k)) & 1u) != 0u) {
            const u32 limit = ((limits >> (8 * k)) & 255u) * 0x01010101u;
            const int at = 16 * side + 4 * k;
            // The multiplication gathers the four flag bits in the top nibble, leftmost pixel lowest.
            row0 |= ((bytes_ge(limit, pixels[first + k]) * 0x10204080u) >> 28) << at;
            row1 |= ((bytes_ge(limit, pixels[first + k + p.row_words * 8]) * 0x10204080u) >> 28) << at;
            row2 |= ((bytes_ge(limit, pixels[first + k + p.row_words * 16]) * 0x10204080u) >> 28) << at;
            row3 |= ((bytes_ge(limit, pixels[first + k + p.row_words * 24]) * 0x10204080u) >> 28) << at;
          }
        }
      }
      const int columns = p.width - word_x * 32;
      const u32 inside = columns >= 32 ? 0xffffffffu : columns <= 0 ? 0u : (1u << columns) - 1u;
      const int y = tile_y * 4;
      const int word = y * p.row_words + word_x;
      if (y < p.height) bits[word] = row0 & inside;
      if (y + 1 < p.height) bits[word + p.row_words] = row1 & inside;
      if (y + 2 < p.height) bits[word + p.row_words * 2] = row2 & inside;
      if (y + 3 < p.height) bits[word + p.row_words * 3] = row3 & inside;
    }
  EACH_END
END
