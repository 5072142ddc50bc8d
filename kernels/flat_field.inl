// pixel' = min(255, round_half_up(pixel * gain / 2^12)): the sensor's and the lens's unevenness taken out.
// Bound: 255 * 65535 + 2048 < 2^24.
FN u32 flat_field_pixel(u32 word, int shift, u32 gain) {
  return min((((word >> shift) & 255u) * gain + 2048u) >> 12, 255u) << shift;
}
KERNEL(flat_field)
IN(0, u32, pixels)  // [words]
IN(1, u32, gains)   // [words, 2]: two gains a word, u16 q12, leftmost in the low half
OUT(2, u32, even)   // [words]
PARAMS(flat_field)
BODY
  EACH_ITEM
    if (GID < p.words) {
      const u32 word = pixels[GID];
      const u32 left = gains[GID * 2];
      const u32 right = gains[GID * 2 + 1];
      even[GID] = flat_field_pixel(word, 0, left & 0xffffu) | flat_field_pixel(word, 8, left >> 16) |
                  flat_field_pixel(word, 16, right & 0xffffu) | flat_field_pixel(word, 24, right >> 16);
    }
  EACH_END
END
