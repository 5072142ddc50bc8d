// convolve by the vectors of a dot header (dot-inl.hpp, dot_vnni.hpp): included into the namespace of each.
namespace {

/// The rows under one row of outputs, with their padding.
using Rows = std::array<u32, kMaxConvolveWords>;

struct Window {
  const u32* rows;     // [kernel_height, row_words], padding included
  std::size_t stride;  // row_words
  bool has_negative;   // then every byte has kOffset added
};

/// Copies the rows that out_tensor row y of tensor n reads.
Window gather(const convolve_params& p, const u32* tensor, int n, int y, Rows& rows) {
  const std::size_t words = static_cast<std::size_t>(p.words);
  const std::size_t width = static_cast<std::size_t>(p.width) * words;
  const std::size_t pad = static_cast<std::size_t>(p.pad_x) * words;
  const std::size_t stride = width + 2 * pad;
  u32 any = 0;
  for (int ky = 0; ky < p.kernel_height; ++ky) {
    u32* to = rows.data() + static_cast<std::size_t>(ky) * stride;
    const int from_y = y * p.stride_y + ky - p.pad_y;
    if (from_y < 0 || from_y >= p.height) {
      std::fill_n(to, stride, 0u);
      continue;
    }
    const u32* from = tensor + static_cast<std::size_t>(n * p.height + from_y) * width;
    std::fill_n(to, pad, 0u);
    std::copy_n(from, width, to + pad);
    std::fill_n(to + pad + width, pad, 0u);
    for (std::size_t i = 0; i < width; ++i) any |= from[i];
  }
  const bool has_negative = (any & 0x80808080u) != 0;
  if (has_negative && kOffset != 0) {
    const std::size_t all = static_cast<std::size_t>(p.kernel_height) * stride;
    for (std::size_t i = 0; i < all; ++i) rows[i] ^= kOffset;
  }
  return {rows.data(), stride, has_negative};
}

/// What the sums of `kVectors * kLanes` channels begin with, so that kOffset has no part in them.
template <bool kSigned, int kVectors>
HWY_INLINE void start_sums(const convolve_params& p, const u32* weight, Sums (&start)[kVectors]) {
  for (Sums& sum : start) sum = zero_sums();
  if (!kSigned || kOffset == 0) return;
  const std::size_t out_channels = static_cast<std::size_t>(p.out_words) * 4;
  for (int tap = 0; tap < p.kernel_height * p.kernel_width * p.group_words; ++tap, weight += out_channels) {
    for (int v = 0; v < kVectors; ++v) {
      start[v] = add_products<false>(start[v], same_word(kOffset), load_words(weight + v * kLanes));
    }
  }
  for (Sums& sum : start) sum = negative(sum);
}

/// `kPixels` neighbouring outputs by kVectors * kLanes channels, from the first.
template <bool kSigned, int kPixels, int kVectors>
HWY_INLINE void tile(const convolve_params& p, const Window& window, int x, const u32* weight,
                     const Sums (&start)[kVectors], const s32* channels, std::size_t group, u8* out) {
  Sums sums[kPixels][kVectors];
  for (auto& pixel : sums) {
    for (int v = 0; v < kVectors; ++v) pixel[v] = start[v];
  }
  const std::size_t words = static_cast<std::size_t>(p.words);
  const std::size_t step = static_cast<std::size_t>(p.stride_x) * words;
  const std::size_t out_channels = static_cast<std::size_t>(p.out_words) * 4;
  for (int ky = 0; ky < p.kernel_height; ++ky) {
    const u32* row =
        window.rows + static_cast<std::size_t>(ky) * window.stride + static_cast<std::size_t>(x) * step + group;
    for (int kx = 0; kx < p.kernel_width; ++kx, row += words) {
      for (int word = 0; word < p.group_words; ++word, weight += out_channels) {
        Words w[kVectors];
        for (int v = 0; v < kVectors; ++v) w[v] = load_words(weight + v * kLanes);
        for (int pixel = 0; pixel < kPixels; ++pixel) {
          const Words a = same_word(row[static_cast<std::size_t>(pixel) * step + static_cast<std::size_t>(word)]);
          for (int v = 0; v < kVectors; ++v) sums[pixel][v] = add_products<kSigned>(sums[pixel][v], a, w[v]);
        }
      }
    }
  }
  for (int pixel = 0; pixel < kPixels; ++pixel) {
    u8* to = out + static_cast<std::size_t>(pixel) * out_channels;
    for (int v = 0; v < kVectors; ++v) requantise(sums[pixel][v], channels + v * kLanes * 2, p.shift, to + v * kLanes);
  }
}

/// A row of kVectors * kLanes channels from `first` on.
template <bool kSigned, int kVectors>
void channel_block(const convolve_params& p, const Window& window, const u32* weights, const s32* channels, int first,
                   u8* out) {
  const s32* block_channels = channels + first * 2;
  const u32* weight = weights + first;
  const std::size_t group = static_cast<std::size_t>(first / 4 / p.group_out_words * p.group_words);
  const int out_channels = p.out_words * 4;
  u8* to = out + first;
  Sums start[kVectors];
  start_sums<kSigned, kVectors>(p, weight, start);
  constexpr int kPixels = tile_pixels(kVectors);
  const auto at = [&](auto pixels, int x) {
    tile<kSigned && kOffset == 0, decltype(pixels)::value, kVectors>(p, window, x, weight, start, block_channels, group,
                                                                     to + x * out_channels);
  };
  int x = 0;
  for (; x + kPixels <= p.out_width; x += kPixels) at(std::integral_constant<int, kPixels>(), x);
  if (x > 0 && p.out_width - x > kPixels / 2) {
    // Some of its pixels a second time: the same bytes.
    at(std::integral_constant<int, kPixels>(), p.out_width - kPixels);
    return;
  }
  for (; x + 3 <= p.out_width; x += 3) at(std::integral_constant<int, 3>(), x);
  for (; x < p.out_width; ++x) at(std::integral_constant<int, 1>(), x);
}

template <bool kSigned>
void output_row(const convolve_params& p, const Window& window, const u32* weights, const s32* channels, u8* out) {
  const int group_channels = p.group_out_words * 4;
  for (int group = 0; group < p.out_words * 4; group += group_channels) {
    int first = group;
    if constexpr (kMostVectors == 4) {
      for (; first + 4 * kLanes <= group + group_channels; first += 4 * kLanes) {
        channel_block<kSigned, 4>(p, window, weights, channels, first, out);
      }
    }
    for (; first + 2 * kLanes <= group + group_channels; first += 2 * kLanes) {
      channel_block<kSigned, 2>(p, window, weights, channels, first, out);
    }
    for (; first + kLanes <= group + group_channels; first += kLanes) {
      channel_block<kSigned, 1>(p, window, weights, channels, first, out);
    }
  }
}

}  // namespace

/// Groups' channels are whole vectors.
void convolve(const convolve_params& p, const u32* tensor, const u32* weights, const s32* channels, u32* out_tensor,
              int first, int last) {
  Rows rows;
  for (int row = first; row < last; ++row) {
    const Window window = gather(p, tensor, row / p.out_height, row % p.out_height, rows);
    u8* out = reinterpret_cast<u8*>(out_tensor + static_cast<std::size_t>(row) *
                                                     static_cast<std::size_t>(p.out_width * p.out_words));
    window.has_negative ? output_row<true>(p, window, weights, channels, out)
                        : output_row<false>(p, window, weights, channels, out);
  }
}
