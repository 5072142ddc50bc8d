// How many tiles have which minimum, maximum and range: one partial histogram a group, of every step-th tile word.
// Counts are sums, so the order of the shared atomics cannot be seen.
KERNEL(tile_histogram)
IN(0, u32, minima)       // [words]
IN(1, u32, maxima)       // [words]
OUT(2, u32, histograms)  // [groups, 3, 256]: minima, maxima, ranges
PARAMS(tile_histogram)
LANES_IF(p.words / (p.groups * p.step) < 8192)  // a turn for each word counted and each of its tiles
SHARED(u32, counts, 768)
BODY
  EACH_ITEM
    for (int bin = LID; bin < 768; bin += GROUP_SIZE) counts[bin] = 0u;
  EACH_END
  EACH_ITEM
    for (int word = GID * p.step; word < p.words; word += p.groups * GROUP_SIZE * p.step) {
      const u32 low = minima[word];
      const u32 high = maxima[word];
      for (int shift = 0; shift < 32; shift += 8) {
        const u32 darkest = (low >> shift) & 255u;
        const u32 lightest = (high >> shift) & 255u;
        ATOMIC_ADD(counts[darkest], 1u);
        ATOMIC_ADD(counts[256u + lightest], 1u);
        ATOMIC_ADD(counts[512u + lightest - darkest], 1u);
      }
    }
  EACH_END
  EACH_ITEM
    for (int bin = LID; bin < 768; bin += GROUP_SIZE) histograms[GROUP * 768 + bin] = counts[bin];
  EACH_END
END
