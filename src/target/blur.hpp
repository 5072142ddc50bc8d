#pragma once

#include <array>

#include "target/layout.hpp"
#include "target/reading.hpp"

namespace berth {

/// How much of a neighbouring module a sample at a module's centre sees, along the columns and the rows.
struct BlurTaps {
  double u = 0, v = 0;
};

/// The taps of a Gaussian blur of `sigma_px` in the image, pixel and interpolation included.
BlurTaps blur_taps(const Reading& reading, double sigma_px);

/// Undoes a little blur: each cell minus what its neighbours leaked into it (first order).
void sharpen(const Layout& layout, const Reading& reading, BlurTaps taps, std::array<double, kMaxCells>& sharp);

/// What the cells would show of a code word (+1 light, -1 dark) under the blur.
void blurred_code(const Layout& layout, u64 word, BlurTaps taps, std::array<double, kMaxCells>& shown);

}  // namespace berth
