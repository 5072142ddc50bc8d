#include "frame/frame_levels.hpp"

#include <algorithm>
#include <utility>

#include "frame/tile_blocks.hpp"

namespace berth {
namespace {

/// The first level whose cumulative share exceeds permille / 1000; 255 when there is none. By bisection: counting bytes
/// is cheaper than a histogram of them.
u32 quantile(const std::vector<u8>& values, int permille) {
  const std::size_t most = values.size() * static_cast<std::size_t>(permille);
  u32 low = 0, high = 255;
  while (low < high) {
    const u32 middle = (low + high) / 2;
    if (count_up_to(values.data(), values.size(), static_cast<u8>(middle)) * 1000 > most) {
      high = middle;
    } else {
      low = middle + 1;
    }
  }
  return low;
}

/// The contrast that the operation normalize asks of a tile; black and white only where they can decide it.
u32 contrast_of(const normalize_params& p, const std::vector<u8>& minima, const std::vector<u8>& maxima,
                const std::vector<u8>& ranges) {
  const auto by_range = [&](u32 range) { return (range * static_cast<u32>(p.contrast_permille) + 500) / 1000; };
  const u32 by_noise = (quantile(ranges, p.noise_permille) * static_cast<u32>(p.noise_gain_q4) + 8) / 16;
  u32 contrast = std::max(by_noise, static_cast<u32>(p.min_contrast));
  if (by_range(255) > contrast) {
    const u32 black = quantile(minima, p.black_permille);
    const u32 white = quantile(maxima, p.white_permille);
    contrast = std::max(contrast, by_range(white > black ? white - black : 0));
  }
  return std::min(contrast, static_cast<u32>(p.max_contrast));
}

std::size_t tiles_counted(const MarkerGeometry& geometry) {
  const int words = geometry.tile_rows * geometry.tile_row_words;
  return static_cast<std::size_t>((words + kHistogramStep - 1) / kHistogramStep) * 4;
}

}  // namespace

FrameLevels::FrameLevels(const MarkerGeometry& whole, const MarkerGeometry& half, std::vector<u32> gains)
    : whole_(whole), half_(half), gains_(std::move(gains)) {
  for (auto* bytes : {&minima_, &maxima_, &ranges_})
    bytes->reserve(std::max(tiles_counted(whole), tiles_counted(half)));
}

/// The pixels from (x0, y0) on, as flat_field leaves them; past the image's end those of its last column and row, and
/// past the padding's end those of its last pair, as halve takes them.
void FrameLevels::copy_block(View2D<const u8> image, int x0, int y0, int side_x, int side_y, u8* block) const {
  for (int y = 0; y < side_y; ++y) {
    for (int x = 0; x < side_x; ++x) {
      const int px = x0 + x < whole_.padded_width ? x0 + x : whole_.padded_width - 2 + x % 2;
      const int py = y0 + y < whole_.padded_height ? y0 + y : whole_.padded_height - 2 + y % 2;
      u32 pixel = image.at(std::min(px, image.width - 1), std::min(py, image.height - 1));
      if (!gains_.empty()) {
        const std::size_t at =
            static_cast<std::size_t>(py) * static_cast<std::size_t>(whole_.padded_width) + static_cast<std::size_t>(px);
        const u32 gain = gains_[at / 2] >> (16 * (at % 2)) & 0xffffu;
        pixel = std::min(255u, (pixel * gain + 2048u) / 4096u);
      }
      block[y * side_x + x] = static_cast<u8>(pixel);
    }
  }
}

/// The extrema of the tile words that tile_histogram counts: every kHistogramStep-th of the image.
void FrameLevels::collect(View2D<const u8> image, const MarkerGeometry& geometry, int scale) {
  const int width = kBlockWidth * scale, height = kBlockHeight * scale;
  for (auto* bytes : {&minima_, &maxima_, &ranges_}) bytes->resize(tiles_counted(geometry));
  u8* low = minima_.data();
  u8* high = maxima_.data();
  int column = 0;
  for (int row = 0; row < geometry.tile_rows; ++row) {
    const int count = std::max(0, (geometry.tile_row_words - column + kHistogramStep - 1) / kHistogramStep);
    const int x = column * width, y = row * height;
    const bool as_it_is = gains_.empty() && y + height <= image.height;
    int inside = 0;  // blocks that need no copy
    if (as_it_is && x + width <= image.width) {
      inside = std::min(count, (image.width - width - x) / (width * kHistogramStep) + 1);
      block_extrema(scale, image.row(y) + x, image.stride, inside, width * kHistogramStep, low, high);
    }
    for (int i = inside; i < count; ++i) {
      u8 copied[4 * kBlockWidth * kBlockHeight];
      copy_block(image, x + i * width * kHistogramStep, y, width, height, copied);
      block_extrema(scale, copied, width, 1, 0, low + 4 * i, high + 4 * i);
    }
    low += 4 * count;
    high += 4 * count;
    column += count * kHistogramStep - geometry.tile_row_words;
  }
  for (std::size_t i = 0; i < ranges_.size(); ++i) ranges_[i] = static_cast<u8>(maxima_[i] - minima_[i]);
}

void FrameLevels::measure(View2D<const u8> image, std::size_t scales) {
  collect(image, whole_, 1);
  levels_[0] = {0, 0, 0, contrast_of(kNormalizeWhole, minima_, maxima_, ranges_)};
  if (scales < 2) return;
  collect(image, half_, 2);
  levels_[1] = {0, 0, 0, contrast_of(kNormalizeHalf, minima_, maxima_, ranges_)};
}

}  // namespace berth
