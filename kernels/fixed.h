// Integer arithmetic that operations share: the same text in every language.

#ifndef BERTH_BYTES  // the prelude's own
// Per byte of two words: 1 where a >= b, 0 elsewhere.
FN u32 bytes_ge(u32 a, u32 b) {
  const u32 low = (a | 0x80808080u) - (b & 0x7f7f7f7fu);  // per byte: no borrow crosses, bit 7 tells low(a) >= low(b)
  return (((a & ~b) | (~(a ^ b) & low)) & 0x80808080u) >> 7;
}
FN u32 bytes_min(u32 a, u32 b) {
  const u32 take_b = bytes_ge(a, b) * 255u;
  return (b & take_b) | (a & ~take_b);
}
FN u32 bytes_max(u32 a, u32 b) {
  const u32 take_a = bytes_ge(a, b) * 255u;
  return (a & take_a) | (b & ~take_a);
}
#endif

// a / b rounded to nearest, halves away from zero. Bounds: b > 0, |a| + b / 2 < 2^31.
FN s32 divide_rounded(s32 a, s32 b) { return a >= 0 ? (a + b / 2) / b : -((b / 2 - a) / b); }

// floor(sqrt(a)).
FN u32 square_root(u32 a) {
  u32 root = 0u;
  for (u32 bit = 0x8000u; bit != 0u; bit >>= 1) {
    const u32 next = root | bit;
    if (next <= 0xffffu && next * next <= a) root = next;
  }
  return root;
}

// A line through n points (u, v) by least squares, from their sums. Products on the way may wrap, the results do not:
// sum_ab is passed as a word. Bounds: |u|, |v| <= 2^11, n <= 2^15, n * max |u v| < 2^31.
FN s32 line_mean(s32 n, s32 sum) { return divide_rounded(sum, n); }
// Sum of (a - mean_a)(b - mean_b), from the sums of a, b and a b.
FN s32 line_moment(s32 n, s32 sum_a, s32 sum_b, u32 sum_ab) {
  const s32 mean_a = line_mean(n, sum_a);
  const s32 mean_b = line_mean(n, sum_b);
  const u32 about = sum_ab - U32(mean_a) * U32(sum_b) - U32(mean_b) * U32(sum_a) + U32(n) * U32(mean_a) * U32(mean_b);
  const s32 rest_a = sum_a - n * mean_a;  // at most n / 2
  const s32 rest_b = sum_b - n * mean_b;
  return S32(about) - divide_rounded(rest_a * rest_b, n);
}
// a / b with q fractional bits, rounded, held within ±limit. Bounds: b > 0, limit * 2^(15 + q) < 2^31.
FN s32 ratio(s32 a, s32 b, int q, s32 limit) {
  s32 size = a < 0 ? -a : a;
  s32 over = b;
  while (over >= 0x8000) {
    over >>= 1;
    size >>= 1;
  }
  const s32 quotient = size >= limit * over ? limit << q : ((size << q) + over / 2) / over;
  return a < 0 ? -quotient : quotient;
}
// 256 times the line's value at the rounded mean of u; its slope has q >= 8 fractional bits. Bound: |slope| <= 2^15.
FN s32 line_value_q8(s32 n, s32 sum_u, s32 sum_v, s32 slope, int q) {
  const s32 mean_v = line_mean(n, sum_v);
  const s32 rest_u = sum_u - n * line_mean(n, sum_u);
  const s32 rest_v = sum_v - n * mean_v;
  return mean_v * 256 + divide_rounded(rest_v * 256 - ((slope * rest_u) >> (q - 8)), n);
}

// What is trimmed off both ends of a side of that length before its line is fitted, half pixels: corners are round.
FN int side_trim(int length) {
  const int trim = length / 8 + 2;
  return length - 2 * trim < 6 ? 0 : trim;
}
// How often a side's coordinates about its middle are halved to keep the line's bounds: never for sides up to 400 px.
FN int side_halvings(int length) {
  int halvings = 0;
  while ((length >> halvings) > 800) halvings += 1;
  return halvings;
}
