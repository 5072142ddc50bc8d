// fully_connected by the vectors of a dot header (dot-inl.hpp, dot_vnni.hpp): included into the namespace of each.
namespace {

/// Channels whose weights are read side by side; positions share them.
constexpr int kChannels = 4;

s32 dot_words(const u32* a, const u32* w, int words) {
  s32 sum = 0;
  for (int i = 0; i < words; ++i) {
    for (int shift = 0; shift < 32; shift += 8) {
      sum += static_cast<signed char>(a[i] >> shift & 255u) * static_cast<signed char>(w[i] >> shift & 255u);
    }
  }
  return sum;
}

/// Sums of kChannels rows of weights at kCount positions.
template <bool kSigned, int kCount>
void products(const fully_connected_params& p, const u32* const* positions, const u32* weights,
              s32 (*sums)[kChannels]) {
  const int row_words = p.columns * p.words;
  const std::size_t each = static_cast<std::size_t>(p.rows * row_words);
  Sums acc[kCount][kChannels];
  for (auto& position : acc) {
    for (Sums& sum : position) sum = zero_sums();
  }
  for (int k = 0; k < kCount; ++k) std::fill_n(sums[k], kChannels, 0);
  for (int y = 0; y < p.rows; ++y) {
    const std::size_t row = static_cast<std::size_t>(y) * static_cast<std::size_t>(p.width * p.words);
    const u32* w = weights + static_cast<std::size_t>(y) * static_cast<std::size_t>(row_words);
    int i = 0;
    for (; i + kLanes <= row_words; i += kLanes) {
      Words ws[kChannels];
      for (std::size_t c = 0; c < kChannels; ++c) ws[c] = load_words(w + c * each + i);
      for (int k = 0; k < kCount; ++k) {
        const Words a = load_words(positions[k] + row + i);
        for (std::size_t c = 0; c < kChannels; ++c) acc[k][c] = add_products<kSigned>(acc[k][c], a, ws[c]);
      }
    }
    if (i == row_words) continue;
    for (int k = 0; k < kCount; ++k) {
      for (std::size_t c = 0; c < kChannels; ++c) {
        sums[k][c] += dot_words(positions[k] + row + i, w + c * each + i, row_words - i);
      }
    }
  }
  for (int k = 0; k < kCount; ++k) {
    for (std::size_t c = 0; c < kChannels; ++c) sums[k][c] += sum_of(acc[k][c]);
  }
}

void store(const fully_connected_params& p, int channel, int position, const s32* channels, const s32* sums,
           u32* out_tensor) {
  u32 word = 0;
  const std::size_t to =
      static_cast<std::size_t>(position) * static_cast<std::size_t>(p.out_channels) + static_cast<std::size_t>(channel);
  for (int c = 0; c < kChannels; ++c) {
    const s32 sum = sums[c] + channels[(channel + c) * 2];
    if (p.shift < 0) {
      out_tensor[to + static_cast<std::size_t>(c)] = static_cast<u32>(sum);
    } else {
      const s32 a = std::clamp((sum + (p.shift > 0 ? 1 << (p.shift - 1) : 0)) >> p.shift, -32768, 32767);
      word |= static_cast<u32>(std::clamp((a * channels[(channel + c) * 2 + 1] + (1 << 21)) >> 22, 0, 127)) << (8 * c);
    }
  }
  if (p.shift >= 0) out_tensor[to / 4] = word;
}

/// Output words [first, last) at every position.
template <bool kSigned>
void words(const fully_connected_params& p, const u32* tensor, const u32* weights, const s32* channels, u32* out_tensor,
           int first, int last) {
  const std::size_t each = static_cast<std::size_t>(p.rows * p.columns * p.words);
  const auto at = [&](int position) {
    const int row = position / p.grid_width;
    const int y = row / p.grid_height * p.height + row % p.grid_height;
    return tensor + static_cast<std::size_t>(y * p.width + position % p.grid_width) * static_cast<std::size_t>(p.words);
  };
  const auto block = [&](auto count, int channel, int position) {
    constexpr int kCount = decltype(count)::value;
    const u32* from[kCount];
    for (int k = 0; k < kCount; ++k) from[k] = at(position + k);
    s32 sums[kCount][kChannels];
    products<kSigned, kCount>(p, from, weights + static_cast<std::size_t>(channel) * each, sums);
    for (int k = 0; k < kCount; ++k) store(p, channel, position + k, channels, sums[k], out_tensor);
  };
  const int all = p.count * p.grid_height * p.grid_width;
  for (int channel = first * kChannels; channel < last * kChannels; channel += kChannels) {
    int position = 0;
    for (; position + kTilePositions <= all; position += kTilePositions) {
      block(std::integral_constant<int, kTilePositions>(), channel, position);
    }
    for (; position < all; ++position) block(std::integral_constant<int, 1>(), channel, position);
  }
}

}  // namespace

void fully_connected(const fully_connected_params& p, const u32* tensor, const u32* weights, const s32* channels,
                     u32* out_tensor, int first, int last) {
  const int all = p.count * p.height * p.width * p.words;
  u32 any = 0;
  for (int i = 0; i < all; ++i) any |= tensor[i];
  (any & 0x80808080u) != 0 ? words<true>(p, tensor, weights, channels, out_tensor, first, last)
                           : words<false>(p, tensor, weights, channels, out_tensor, first, last);
}
