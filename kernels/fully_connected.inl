// A kernel as large as its tensor, or applied at a grid of positions in a larger one. A work-group makes
// FULLY_CONNECTED_WORDS output words (four channels each: sums a to d) at FULLY_CONNECTED_POSITIONS positions, which
// share the weights it reads; 32 items split each inner product. Sums of integers do not depend on how they are split.
// Bound: as in convolve.
#define FULLY_CONNECTED_EACH_POSITION(X) X(0) X(1) X(2) X(3)
#define FULLY_CONNECTED_START(k)                                                                                       \
  const int position##k = min(first + k, positions - 1);                                                               \
  const int row##k = position##k / p.grid_width;                                                                       \
  const int from##k =                                                                                                  \
      ((row##k / p.grid_height * p.height + row##k % p.grid_height) * p.width + position##k % p.grid_width) * p.words; \
  s32 a##k = 0;                                                                                                        \
  s32 b##k = 0;                                                                                                        \
  s32 c##k = 0;                                                                                                        \
  s32 d##k = 0;
#define FULLY_CONNECTED_ADD(k)               \
  if (first + k < positions) {               \
    const u32 q = tensor[from##k + row + i]; \
    a##k = dot_s8(q, w0, a##k);              \
    b##k = dot_s8(q, w1, b##k);              \
    c##k = dot_s8(q, w2, c##k);              \
    d##k = dot_s8(q, w3, d##k);              \
  }
#define FULLY_CONNECTED_SHARE(k)                 \
  shares[(k * 4 + 0) * GROUP_SIZE + LID] = a##k; \
  shares[(k * 4 + 1) * GROUP_SIZE + LID] = b##k; \
  shares[(k * 4 + 2) * GROUP_SIZE + LID] = c##k; \
  shares[(k * 4 + 3) * GROUP_SIZE + LID] = d##k;

KERNEL(fully_connected)
IN(0, u32, tensor)       // [count, height, width, words]
IN(1, u32, weights)      // [out_channels, rows, columns, words]
IN(2, s32, channels)     // [out_channels, 2]
OUT(3, u32, out_tensor)  // [count * grid_height * grid_width, out_channels / 4]; raw: s32, a word a channel
PARAMS(fully_connected)
STRIDE_IF(p.rows*(p.columns* p.words / 32 + 2) < 4000)  // 16 items' turns
SHARED(s32, shares, 2048)                               // [positions, 4 channels, words, 32]
SHARED(s32, sums, 64)                                   // [positions, words, 4 channels]
BODY
  EACH_ITEM
    const int out_words = p.out_channels / 4;
    const int word_groups = (out_words + FULLY_CONNECTED_WORDS - 1) / FULLY_CONNECTED_WORDS;
    const int out_word = min(GROUP % word_groups * FULLY_CONNECTED_WORDS + (LID >> 5), out_words - 1);
    const int positions = p.count * p.grid_height * p.grid_width;
    const int first = GROUP / word_groups * FULLY_CONNECTED_POSITIONS;
    const int row_words = p.columns * p.words;
    const int channel_words = p.rows * row_words;
    FULLY_CONNECTED_EACH_POSITION(FULLY_CONNECTED_START)
    for (int y = 0; y < p.rows; ++y) {
      const int row = y * p.width * p.words;
      const int weight = out_word * 4 * channel_words + y * row_words;
      for (int i = LID & 31; i < row_words; i += 32) {
        const u32 w0 = weights[weight + i];
        const u32 w1 = weights[weight + channel_words + i];
        const u32 w2 = weights[weight + 2 * channel_words + i];
        const u32 w3 = weights[weight + 3 * channel_words + i];
        FULLY_CONNECTED_EACH_POSITION(FULLY_CONNECTED_ADD)
      }
    }
    FULLY_CONNECTED_EACH_POSITION(FULLY_CONNECTED_SHARE)
  EACH_END
  FIRST_ITEMS(64) {
    // Item [position, word, channel]; each begins elsewhere, so that no two read the same bank of memory.
    const int from = ((LID >> 4) * 4 + (LID & 3)) * GROUP_SIZE + (LID >> 2 & 3) * 32;
    s32 sum = 0;
    for (int i = 0; i < 32; ++i) sum += shares[from + ((i + LID) & 31)];
    sums[LID] = sum;
  }
  BARRIER;
  FIRST_ITEMS(16) {
    const int out_words = p.out_channels / 4;
    const int word_groups = (out_words + FULLY_CONNECTED_WORDS - 1) / FULLY_CONNECTED_WORDS;
    const int out_word = GROUP % word_groups * FULLY_CONNECTED_WORDS + (LID & 3);
    const int position = GROUP / word_groups * FULLY_CONNECTED_POSITIONS + (LID >> 2);
    if (out_word < out_words && position < p.count * p.grid_height * p.grid_width) {
      const int to = position * out_words + out_word;
      u32 word = 0u;
      for (int k = 0; k < 4; ++k) {
        const int channel = (out_word * 4 + k) * 2;
        const s32 sum = sums[LID * 4 + k] + channels[channel];
        if (p.shift < 0) {
          out_tensor[to * 4 + k] = U32(sum);
        } else {
          word |= requantize(sum, channels[channel + 1], p.shift) << (8 * k);
        }
      }
      if (p.shift >= 0) out_tensor[to] = word;
    }
  }
  BARRIER;
END
