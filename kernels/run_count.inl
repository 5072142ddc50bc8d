// How many run ends come before each word of bits, within its group of 128 words, and how many each group has.
// A run that reaches the right border ends there, in the row's last word: at most 33 run ends a word.
KERNEL(run_count)
IN(0, u32, bits)      // [height, row_words]
OUT(1, u32, offsets)  // [base_at + groups]; words past the last of bits count nothing
PARAMS(run_count)
LANES_IF(true)  // 512 turns
SHARED(u32, sums, 128)
BODY
  EACH_ITEM
    u32 count = 0u;
    if (GID < p.height * p.row_words) {
      const int x = GID % p.row_words;
      const u32 here = bits[GID];
      count = POPCOUNT(here ^ ((here << 1) | (x > 0 ? bits[GID - 1] >> 31 : 0u)));
      if (x == p.row_words - 1) count += here >> 31;
    }
    sums[LID] = count;
  EACH_END
  FIRST_ITEMS(1) {  // 128 numbers: the group's first item adds them up faster than seven barriers would
    u32 before = 0u;
    for (int i = 0; i < GROUP_SIZE; ++i) {
      const u32 count = sums[i];
      sums[i] = before;
      before += count;
    }
    offsets[p.base_at + GROUP] = before;
  }
  BARRIER;
  EACH_ITEM
    offsets[GID] = sums[LID];
  EACH_END
END
