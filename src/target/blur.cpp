#include "target/blur.hpp"

#include <cmath>

namespace berth {
namespace {

// Share of a Gaussian beyond half a module, for sigma = 0, 0.1, 0.2 … modules: Q(0.5 / sigma). Three modules a row is
// all that is modelled, so it ends where the neighbours weigh as much as the module itself.
constexpr double kBeyond[] = {0,       2.9e-7,  0.00621, 0.04779, 0.10565, 0.15866,
                              0.20233, 0.23753, 0.26599, 0.28926, 0.30854};
constexpr double kMaxTap = 0.3;

// The pixel's own square (variance 1/12) and bilinear interpolation (mean of f(1 - f), 1/6).
constexpr double kPixelVariance = 1.0 / 12 + 1.0 / 6;

double tap(double sigma_px, double module_px) {
  const double at = 10 * std::sqrt(sigma_px * sigma_px + kPixelVariance) / module_px;
  if (!(at < 10)) return kMaxTap;
  const int i = static_cast<int>(at);
  const double value = kBeyond[i] + (kBeyond[i + 1] - kBeyond[i]) * (at - i);
  return value < kMaxTap ? value : kMaxTap;
}

// Positions in Layout::neighbours.
enum { kUpLeft, kUp, kUpRight, kLeft, kRight, kDownLeft, kDown, kDownRight };

}  // namespace

BlurTaps blur_taps(const Reading& reading, double sigma_px) {
  return {tap(sigma_px, reading.module_u_px), tap(sigma_px, reading.module_v_px)};
}

void sharpen(const Layout& layout, const Reading& reading, BlurTaps taps, std::array<double, kMaxCells>& sharp) {
  const double level[] = {0, reading.half_contrast, -reading.half_contrast};  // unknown, light, dark: index + 3
  for (std::size_t i = 0; i < layout.x.size(); ++i) {
    const int* const near = &layout.neighbours[8 * i];
    const auto value = [&](int k) { return near[k] >= 0 ? reading.value[near[k]] : level[near[k] + 3]; };
    const double own = reading.value[i];
    sharp[i] = own + taps.u * (2 * own - value(kLeft) - value(kRight)) + taps.v * (2 * own - value(kUp) - value(kDown));
  }
}

void blurred_code(const Layout& layout, u64 word, BlurTaps taps, std::array<double, kMaxCells>& shown) {
  const double centre_u = 1 - 2 * taps.u, centre_v = 1 - 2 * taps.v;
  const double level[] = {0, 1, -1};
  for (std::size_t i = 0; i < layout.x.size(); ++i) {
    const int* const near = &layout.neighbours[8 * i];
    const auto bit = [&](int cell) { return (word >> cell) & 1 ? 1.0 : -1.0; };
    const auto value = [&](int k) { return near[k] >= 0 ? bit(near[k]) : level[near[k] + 3]; };
    const double own = bit(static_cast<int>(i));
    shown[i] = centre_v * (centre_u * own + taps.u * (value(kLeft) + value(kRight))) +
               taps.v * (centre_u * (value(kUp) + value(kDown)) +
                         taps.u * (value(kUpLeft) + value(kUpRight) + value(kDownLeft) + value(kDownRight)));
  }
}

}  // namespace berth
