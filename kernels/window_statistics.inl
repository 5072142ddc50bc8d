// A window's mean, and the gain that brings its standard deviation to 48, q8: a work-group a window.
// Bound: 66051 pixels, whose squares sum up to less than 2^32.
KERNEL(window_statistics)
IN(0, u32, pixels)       // [count, words]
OUT(1, s32, statistics)  // [count, 2]: mean, gain
PARAMS(window_statistics)
STRIDE_IF(true)  // at most 16513 words
SHARED(u32, sums, 2)
BODY
  FIRST_ITEMS(2) { sums[LID] = 0u; }
  BARRIER;
  EACH_ITEM
    u32 sum = 0u;
    u32 squares = 0u;
    for (int word = LID * p.stride; word < p.words; word += GROUP_SIZE * p.stride) {
      const u32 four = pixels[GROUP * p.words + word];
      const u32 a = four & 255u;
      const u32 b = (four >> 8) & 255u;
      const u32 c = (four >> 16) & 255u;
      const u32 d = four >> 24;
      sum += a + b + c + d;
      squares += a * a + b * b + c * c + d * d;
    }
    ATOMIC_ADD(sums[0], sum);
    ATOMIC_ADD(sums[1], squares);
  EACH_END
  FIRST_ITEMS(1) {
    const u32 n = U32((p.words + p.stride - 1) / p.stride) * 4u;
    const u32 mean = (sums[0] + n / 2u) / n;
    const u32 mean_square = sums[1] / n;
    const u32 deviation = max(square_root(mean_square - min(mean_square, mean * mean)), 1u);
    statistics[GROUP * 2] = S32(mean);
    statistics[GROUP * 2 + 1] = S32(min(max((256u * 48u + deviation / 2u) / deviation, 128u), 2048u));
  }
  BARRIER;
END
