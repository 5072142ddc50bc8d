// The greatest s8 of kernel x kernel pixels, channel by channel; an item a word. Flipped sign bits order s8 as u8.
KERNEL(max_pool)
IN(0, u32, tensor)       // [count, height, width, words]
OUT(1, u32, out_tensor)  // [count, out_height, out_width, words]
PARAMS(max_pool)
BODY
  EACH_ITEM
    const int pixel = GID / p.words;
    const int row = pixel / p.out_width;
    const int n = row / p.out_height;
    if (n < p.count) {
      const int x = (pixel - row * p.out_width) * p.stride;
      const int y = (row - n * p.out_height) * p.stride;
      const int from = ((n * p.height + y) * p.width + x) * p.words + GID - pixel * p.words;
      u32 greatest = 0u;
      for (int ky = 0; ky < p.kernel_side; ++ky) {
        for (int kx = 0; kx < p.kernel_side; ++kx) {
          greatest = bytes_max(greatest, tensor[from + (ky * p.width + kx) * p.words] ^ 0x80808080u);
        }
      }
      out_tensor[GID] = greatest ^ 0x80808080u;
    }
  EACH_END
END
