// The frame's levels: black, white and noise as quantiles of its tiles, and the contrast that a tile must have to be
// judged at all. Stretching the contrast of every pixel and then asking for a fixed contrast is the same as asking for
// a share of white - black in the pixels as they are; so no pixel is rewritten (docs/marker-pipeline.md).
// A quantile is the first level whose cumulative count exceeds count * permille / 1000. Bounds: count < 2^21.
KERNEL(normalize)
IN(0, u32, histograms)  // [groups, 3, 256]
OUT(1, u32, levels)     // [4]: black, white, noise, contrast
PARAMS(normalize)
LANES_IF(p.groups <= 32)  // 768 turns a partial histogram
SHARED(u32, counts, 768)
SHARED(u32, quantiles, 3)
BODY
  EACH_ITEM
    for (int bin = LID; bin < 768; bin += GROUP_SIZE) {
      u32 sum = 0u;
      for (int group = 0; group < p.groups; ++group) sum += histograms[group * 768 + bin];
      counts[bin] = sum;
    }
  EACH_END
  FIRST_ITEMS(3) {
    const int permille = LID == 0 ? p.black_permille : LID == 1 ? p.white_permille : p.noise_permille;
    u32 count = 0u;
    for (int bin = 0; bin < 256; ++bin) count += counts[LID * 256 + bin];
    u32 level = 255u;
    u32 below = 0u;
    for (int bin = 0; bin < 256; ++bin) {
      below += counts[LID * 256 + bin];
      if (level == 255u && below * 1000u > count * U32(permille)) level = U32(bin);
    }
    quantiles[LID] = level;
  }
  BARRIER;
  FIRST_ITEMS(1) {
    const u32 black = quantiles[0];
    const u32 white = quantiles[1];
    const u32 noise = quantiles[2];
    const u32 range = white > black ? white - black : 0u;
    const u32 by_range = (range * U32(p.contrast_permille) + 500u) / 1000u;
    const u32 by_noise = (noise * U32(p.noise_gain_q4) + 8u) >> 4;
    levels[0] = black;
    levels[1] = white;
    levels[2] = noise;
    levels[3] = min(max(max(by_range, by_noise), U32(p.min_contrast)), U32(p.max_contrast));
  }
  BARRIER;
END
