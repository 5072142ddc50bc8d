// Convolution of s8 tensors with any kernel, stride, padding and groups; then bias, ReLU and requantisation.
// An item makes one output word (four channels: sums a to d) of CONVOLVE_PIXELS neighbouring pixels, so that a kernel
// tap's weights serve all of them. With a horizontal stride of 1 its pixels' input moves along by one word a tap; else
// each tap reads its own. Memory is what costs: four weights and one to sixteen inputs for 256 products.
// Bound: the model's exporter proves for each channel that its sum, bias and rounding stay below 2^31.
#define CONVOLVE_EACH_PIXEL(X) X(0) X(1) X(2) X(3) X(4) X(5) X(6) X(7) X(8) X(9) X(10) X(11) X(12) X(13) X(14) X(15)
#define CONVOLVE_START(i) \
  s32 a##i = 0;           \
  s32 b##i = 0;           \
  s32 c##i = 0;           \
  s32 d##i = 0;
#define CONVOLVE_LOAD(i)                                             \
  u32 q##i = 0u;                                                     \
  if (left + i * p.stride_x >= 0 && left + i * p.stride_x < p.width) \
    q##i = tensor[row + (left + i * p.stride_x) * p.words];
#define CONVOLVE_TAP(i)          \
  a##i = dot_s8(q##i, w0, a##i); \
  b##i = dot_s8(q##i, w1, b##i); \
  c##i = dot_s8(q##i, w2, c##i); \
  d##i = dot_s8(q##i, w3, d##i);
#define CONVOLVE_STORE(i)                                                                    \
  if (x + i < p.out_width)                                                                   \
    out_tensor[to + i * p.out_words] =                                                       \
        requantize(a##i + bias0, m0, p.shift) | requantize(b##i + bias1, m1, p.shift) << 8 | \
        requantize(c##i + bias2, m2, p.shift) << 16 | requantize(d##i + bias3, m3, p.shift) << 24;

KERNEL(convolve)
IN(0, u32, tensor)       // [count, height, width, words]
IN(1, u32, weights)      // [kernel_height, kernel_width, group_words, out_words * 4]
IN(2, s32, channels)     // [out_words * 4, 2]
OUT(3, u32, out_tensor)  // [count, out_height, out_width, out_words]
PARAMS(convolve)
BODY
  EACH_ITEM
    const int blocks = (p.out_width + CONVOLVE_PIXELS - 1) / CONVOLVE_PIXELS;
    const int block = GID / p.out_words;
    const int out_row = block / blocks;
    const int out_word = GID - block * p.out_words;
    const int n = out_row / p.out_height;
    if (n < p.count) {
      const int y = out_row - n * p.out_height;
      const int x = (block - out_row * blocks) * CONVOLVE_PIXELS;
      const int from_y = y * p.stride_y - p.pad_y;
      const int from_x = x * p.stride_x - p.pad_x;
      const int group = out_word / p.group_out_words * p.group_words;
      const int last_ky = min(p.kernel_height, p.height - from_y);
      const int taps = p.stride_x == 1 ? p.kernel_width : 1;  // that share what is read
      CONVOLVE_EACH_PIXEL(CONVOLVE_START)
      for (int ky = max(0, -from_y); ky < last_ky; ++ky) {
        for (int word = 0; word < p.group_words; ++word) {
          const int row = (n * p.height + from_y + ky) * p.width * p.words + group + word;
          for (int first_kx = 0; first_kx < p.kernel_width; first_kx += taps) {
            const int left = from_x + first_kx;
            CONVOLVE_EACH_PIXEL(CONVOLVE_LOAD)
            for (int tap = 0; tap < taps; ++tap) {
              const int weight =
                  (((ky * p.kernel_width + first_kx + tap) * p.group_words + word) * p.out_words + out_word) * 4;
              const u32 w0 = weights[weight];
              const u32 w1 = weights[weight + 1];
              const u32 w2 = weights[weight + 2];
              const u32 w3 = weights[weight + 3];
              CONVOLVE_EACH_PIXEL(CONVOLVE_TAP)
              q0 = q1;
              q1 = q2;
              q2 = q3;
              q3 = q4;
              q4 = q5;
              q5 = q6;
              q6 = q7;
              q7 = q8;
              q8 = q9;
              q9 = q10;
              q10 = q11;
              q11 = q12;
              q12 = q13;
              q13 = q14;
              q14 = q15;
              q15 = 0u;
              const int next = left + tap + CONVOLVE_PIXELS;
              if (tap + 1 < taps && next >= 0 && next < p.width) q15 = tensor[row + next * p.words];
            }
          }
        }
      }
      const int channel = out_word * 8;
      const s32 bias0 = channels[channel];
      const s32 m0 = channels[channel + 1];
      const s32 bias1 = channels[channel + 2];
      const s32 m1 = channels[channel + 3];
      const s32 bias2 = channels[channel + 4];
      const s32 m2 = channels[channel + 5];
      const s32 bias3 = channels[channel + 6];
      const s32 m3 = channels[channel + 7];
      const int to = (out_row * p.out_width + x) * p.out_words + out_word;
      CONVOLVE_EACH_PIXEL(CONVOLVE_STORE)
    }
  EACH_END
END
