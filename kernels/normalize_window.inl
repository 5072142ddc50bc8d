// Windows about their mean and times their gain, as the network reads them: s8.
FN u32 normalized_pixel(u32 four, int shift, s32 mean, s32 gain) {
  const s32 pixel = S32((four >> shift) & 255u);
  return (U32(min(max(((pixel - mean) * gain + 128) >> 8, -128), 127)) & 255u) << shift;
}
KERNEL(normalize_window)
IN(0, u32, pixels)      // [count, words]
IN(1, s32, statistics)  // [count, 2]: mean; gain, q8, 2048 at most
OUT(2, u32, tensor)     // [count, words]
PARAMS(normalize_window)
BODY
  EACH_ITEM
    if (GID < p.count * p.words) {
      const int window = GID / p.words;
      const s32 mean = statistics[window * 2];
      const s32 gain = statistics[window * 2 + 1];
      const u32 four = pixels[GID];
      tensor[GID] = normalized_pixel(four, 0, mean, gain) | normalized_pixel(four, 8, mean, gain) |
                    normalized_pixel(four, 16, mean, gain) | normalized_pixel(four, 24, mean, gain);
    }
  EACH_END
END
