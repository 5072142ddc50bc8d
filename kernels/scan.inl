// Exclusive prefix sums in place, by one work-group; the total follows the last.
KERNEL(scan)
INOUT(0, u32, values)  // [first + count + 1]
PARAMS(scan)
LANES_IF(p.count < 16384)  // two turns a value
SHARED(u32, sums, 128)
BODY
  EACH_ITEM
    const int share = (p.count + GROUP_SIZE - 1) / GROUP_SIZE;
    const int end = min((LID + 1) * share, p.count);
    u32 sum = 0u;
    for (int i = LID * share; i < end; ++i) sum += values[p.first + i];
    sums[LID] = sum;
  EACH_END
  FIRST_ITEMS(1) {
    u32 before = 0u;
    for (int i = 0; i < GROUP_SIZE; ++i) {
      const u32 sum = sums[i];
      sums[i] = before;
      before += sum;
    }
    values[p.first + p.count] = before;
  }
  BARRIER;
  EACH_ITEM
    const int share = (p.count + GROUP_SIZE - 1) / GROUP_SIZE;
    const int end = min((LID + 1) * share, p.count);
    u32 before = sums[LID];
    for (int i = LID * share; i < end; ++i) {
      const u32 value = values[p.first + i];
      values[p.first + i] = before;
      before += value;
    }
  EACH_END
END
