#pragma once

#include <array>

#include "sim/scene.hpp"

namespace berth::bench {

/// Cramér-Rao bound of a marker's corners, 2-D RMS px: what no unbiased estimator of eight corner coordinates can beat
/// that knows the pattern and has to find levels of dark and light (planes) and the blur as well, from all pixels of
/// the pattern and its light ring. Gaussian blur, straight tone curve, noise with the rounding to integers. Written
/// apart from the engine: doubles and libm's erf.
double corner_bound_px(const sim::Scene& scene);

}  // namespace berth::bench
