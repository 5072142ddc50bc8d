// The frame's levels: black, white and noise as quantiles of its tiles, and the contrast that a tile must have to be
// judged at all. Stretching the contrast of every pixel and then asking for a fixed contrast is the same as asking for
// a share of white - black in the pixels as they are; so no pixel is rewritten (docs/marker-pipeline.md).
// A quantile is the first level whose cumulative count exceeds count * permille / 1000. Bounds: count < 2^21.
KERNEL(normalize)
IN(0, u32, histograms)    // [groups, 3, 256]
OUT(1, u32, levels)       // [4]: black, white, noise, contrast
PARAMS(normalize)
SHARED(u32, counts, 768)
BODY
  EACH_ITEM
    for (int bin = LID; bin < 768; bin += GROUP_SIZE) {
      u32 sum = 0u;
      for (int group = 0; group < p.groups; ++group) sum += histograms[group * 768 + bin];
      counts[bin] = sum;
    }
  EACH_END
  EACH_ITEM
    if (LID == 0) {
      u32 count = 0u;
      for (int bin = 0; bin < 256; ++bin) count += counts[bin];
      u32 black = 255u;
      u32 white = 255u;
      u32 noise = 255u;
      u32 below_black = 0u;
      u32 below_white = 0u;
      u32 below_noise = 0u;
      for (int bin = 0; bin < 256; ++bin) {
        below_black += counts[bin];
        below_white += counts[256 + bin];
        below_noise += counts[512 + bin];
        if (black == 255u && below_black * 1000u > count * U32(p.black_permille)) black = U32(bin);
        if (white == 255u && below_white * 1000u > count * U32(p.white_permille)) white = U32(bin);
        if (noise == 255u && below_noise * 1000u > count * U32(p.noise_permille)) noise = U32(bin);
      }
      const u32 range = white > black ? white - black : 0u;
      const u32 by_range = (range * U32(p.contrast_permille) + 500u) / 1000u;
      const u32 by_noise = (noise * U32(p.noise_gain_q4) + 8u) >> 4;
      levels[0] = black;
      levels[1] = white;
      levels[2] = noise;
      levels[3] = min(max(max(by_range, by_noise), U32(p.min_contrast)), U32(p.max_contrast));
    }
  EACH_END
END
