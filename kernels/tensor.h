// What the network's operations share: sums of s8 products and their requantisation.

// acc + the products of the words' four s8.
#ifndef BERTH_DOT_S8  // the prelude's own
FN s32 dot_s8(u32 a, u32 b, s32 acc) {
  return acc + (S32(a << 24) >> 24) * (S32(b << 24) >> 24) + (S32(a << 16) >> 24) * (S32(b << 16) >> 24) +
         (S32(a << 8) >> 24) * (S32(b << 8) >> 24) + (S32(a) >> 24) * (S32(b) >> 24);
}
#endif
// A sum of a convolution as an activation, with ReLU; see docs/network-arithmetic.md.
// Bounds: 0 <= shift <= 31, 0 <= multiplier < 2^15, |acc| and the rounding together below 2^31.
FN u32 requantize(s32 acc, s32 multiplier, int shift) {
  const s32 rounding = shift > 0 ? 1 << (shift - 1) : 0;
  const s32 a = min(max((acc + rounding) >> shift, -32768), 32767);
  return U32(min(max((a * multiplier + (1 << 21)) >> 22, 0), 127));
}
