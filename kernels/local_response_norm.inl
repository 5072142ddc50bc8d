// Local response normalisation over five channels, by a table of the factor t at sums S of halved squares: knots every
// 32 up to 2048, then every 1024, between them straight lines.
// Bounds: S <= 5 * 2^13; 0 <= T < 2^16, so t * 128 < 2^23.
FN s32 response_half_square(u32 word, int shift) {
  const s32 a = S32(word << (24 - shift)) >> 24;
  return (a * a) >> 1;
}
FN int response_knot(s32 sum) { return sum < 2048 ? sum >> 5 : 62 + (sum >> 10); }
FN u32 response(u32 word, int shift, s32 sum, s32 low, s32 high) {
  const s32 a = S32(word << (24 - shift)) >> 24;
  const s32 fraction = sum < 2048 ? (sum & 31) << 3 : (sum & 1023) >> 2;
  const s32 factor = low + (((high - low) * fraction + 128) >> 8);
  return (U32(min((a * factor + 8192) >> 14, 127)) & 255u) << shift;
}
KERNEL(local_response_norm)
IN(0, u32, tensor)       // [pixels, words]
IN(1, s32, table)        // [RESPONSE_TABLE]
OUT(2, u32, out_tensor)  // [pixels, words]
PARAMS(local_response_norm)
BODY
  EACH_ITEM
    if (GID < p.pixels * p.words) {
      const int at = GID % p.words;
      u32 before = 0u;
      u32 after = 0u;
      if (at > 0) before = tensor[GID - 1];
      if (at + 1 < p.words) after = tensor[GID + 1];
      const u32 word = tensor[GID];
      const s32 a = response_half_square(word, 0);
      const s32 b = response_half_square(word, 8);
      const s32 c = response_half_square(word, 16);
      const s32 d = response_half_square(word, 24);
      const s32 left = response_half_square(before, 24);
      const s32 right = response_half_square(after, 0);
      const s32 sum_a = response_half_square(before, 16) + left + a + b + c;
      const s32 sum_b = left + a + b + c + d;
      const s32 sum_c = a + b + c + d + right;
      const s32 sum_d = b + c + d + right + response_half_square(after, 8);
      const int knot_a = response_knot(sum_a);
      const int knot_b = response_knot(sum_b);
      const int knot_c = response_knot(sum_c);
      const int knot_d = response_knot(sum_d);
      out_tensor[GID] = response(word, 0, sum_a, table[knot_a], table[knot_a + 1]) |
                        response(word, 8, sum_b, table[knot_b], table[knot_b + 1]) |
                        response(word, 16, sum_c, table[knot_c], table[knot_c + 1]) |
                        response(word, 24, sum_d, table[knot_d], table[knot_d + 1]);
    }
  EACH_END
END
