// The darkest and the lightest pixel of every 4 × 4 tile; an item makes the four tiles of a tile word.
FN u32 lowest_byte(u32 word) {
  const u32 pair = bytes_min(word, word >> 16);
  return bytes_min(pair, pair >> 8) & 255u;
}
FN u32 highest_byte(u32 word) {
  const u32 pair = bytes_max(word, word >> 16);
  return bytes_max(pair, pair >> 8) & 255u;
}
KERNEL(tile_extrema)
IN(0, u32, pixels)   // [tile_rows * 4, row_words * 4]
OUT(1, u32, minima)  // [tile_rows, row_words]
OUT(2, u32, maxima)  // [tile_rows, row_words]
PARAMS(tile_extrema)
BODY
  EACH_ITEM
    if (GID < p.tile_rows * p.row_words) {
      const int stride = p.row_words * 4;
      const int first = GID / p.row_words * 4 * stride + GID % p.row_words * 4;
      u32 low = 0u;
      u32 high = 0u;
      for (int k = 0; k < 4; ++k) {
        const u32 a = pixels[first + k];
        const u32 b = pixels[first + k + stride];
        const u32 c = pixels[first + k + stride * 2];
        const u32 d = pixels[first + k + stride * 3];
        low |= lowest_byte(bytes_min(bytes_min(a, b), bytes_min(c, d))) << (8 * k);
        high |= highest_byte(bytes_max(bytes_max(a, b), bytes_max(c, d))) << (8 * k);
      }
      minima[GID] = low;
      maxima[GID] = high;
    }
  EACH_END
END
