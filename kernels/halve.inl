// The image at half its size: each pixel the mean of four, rounded half up. Noise halves with it, which large, dark and
// blurred markers need more than resolution. Past the source's padding its last pair of columns and of rows repeats.
FN u32 halve_pairs(u32 upper, u32 lower) {
  // Two sums of four bytes each, in the halves of the word: at most 1020 + 2.
  const u32 sums = (upper & 0x00ff00ffu) + ((upper >> 8) & 0x00ff00ffu) + (lower & 0x00ff00ffu) +
                   ((lower >> 8) & 0x00ff00ffu) + 0x00020002u;
  const u32 means = (sums >> 2) & 0x00ff00ffu;
  return (means | (means >> 8)) & 0xffffu;
}
KERNEL(halve)
IN(0, u32, pixels)        // [rows, row_words]
OUT(1, u32, half_pixels)  // [half_rows, half_row_words]
PARAMS(halve)
BODY
  EACH_ITEM
    if (GID < p.half_rows * p.half_row_words) {
      const int y = min(GID / p.half_row_words * 2, p.rows - 2);
      const int x = GID % p.half_row_words * 2;
      const int upper = y * p.row_words;
      const int lower = upper + p.row_words;
      const int last = p.row_words - 1;
      u32 left = halve_pairs(pixels[upper + min(x, last)], pixels[lower + min(x, last)]);
      u32 right = halve_pairs(pixels[upper + min(x + 1, last)], pixels[lower + min(x + 1, last)]);
      if (x > last) left = (left >> 8) * 0x0101u;
      if (x + 1 > last) right = (right >> 8) * 0x0101u;
      half_pixels[GID] = left | (right << 16);
    }
  EACH_END
END
