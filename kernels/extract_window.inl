// Cuts square windows out of the image at any scale from 1 to 10 image pixels a window pixel: each window pixel is the
// mean of the area it covers, weighted by overlaps in 1/256 px. Outside the image its nearest pixel counts.
// Bounds: corners within ±2^28; a row of weights sums up to step <= 2560, so 255 * step^2 + step^2 / 2 < 2^31.

// What the pixel at x has in common with [low, high), 1/256 px.
FN u32 window_overlap(int x, int low, int high) { return U32(max(min(high, x * 256 + 256) - max(low, x * 256), 0)); }

KERNEL(extract_window)
IN(0, u32, pixels)       // [padded_height, row_words]
IN(1, s32, windows)      // [count, 4]: x and y of the corner and step, 1/256 px; one unused
OUT(2, u32, out_pixels)  // [count, out_height, out_words]
PARAMS(extract_window)
BODY
  EACH_ITEM
    const int row = GID / p.out_words;
    const int window = row / p.out_height;
    if (window < p.count) {
      const int step = max(min(windows[window * 4 + 2], 2560), 256);
      const int left = windows[window * 4] + GID % p.out_words * 4 * step;
      const int top = windows[window * 4 + 1] + row % p.out_height * step;
      const int last_x = p.width - 1;
      u32 sum0 = 0u;
      u32 sum1 = 0u;
      u32 sum2 = 0u;
      u32 sum3 = 0u;
      for (int y = top >> 8; y <= (top + step - 1) >> 8; ++y) {
        const int from = min(max(y, 0), p.height - 1) * p.row_words;
        u32 row0 = 0u;
        u32 row1 = 0u;
        u32 row2 = 0u;
        u32 row3 = 0u;
        for (int word = left >> 10; word <= (left + 4 * step - 1) >> 10; ++word) {
          const u32 four = pixels[from + min(max(word, 0), last_x >> 2)];
          for (int x = word * 4; x < word * 4 + 4; ++x) {
            const u32 pixel = (four >> (8 * (min(max(x, 0), last_x) & 3))) & 255u;
            row0 += window_overlap(x, left, left + step) * pixel;
            row1 += window_overlap(x, left + step, left + 2 * step) * pixel;
            row2 += window_overlap(x, left + 2 * step, left + 3 * step) * pixel;
            row3 += window_overlap(x, left + 3 * step, left + 4 * step) * pixel;
          }
        }
        const u32 weight = window_overlap(y, top, top + step);
        sum0 += weight * row0;
        sum1 += weight * row1;
        sum2 += weight * row2;
        sum3 += weight * row3;
      }
      const u32 area = U32(step * step);
      const u32 half_area = area >> 1;
      out_pixels[GID] = (sum0 + half_area) / area | ((sum1 + half_area) / area) << 8 |
                        ((sum2 + half_area) / area) << 16 | ((sum3 + half_area) / area) << 24;
    }
  EACH_END
END
