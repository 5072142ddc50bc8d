#include "plan/corner_noise.hpp"

#include <algorithm>
#include <cmath>

#include "pose_algebra.hpp"

namespace berth::plan {
namespace {

// Berth's refinement of sides (src/reference/edge_refine.cpp), the numbers fitted to rendered frames (docs/plan.md).
// Rows looked at on a side: at most 32 (as good as 40 straight across: most cross a slanted side), none in the eighth
// and the pixel at either end.
constexpr double kMostRows = 40, kTrim = 0.125, kTrim_px = 1, kFewestRows = 3;
// How many times the bound a row's place is off by noise, by the edge's blur.
constexpr double kTimesBound = 0.66, kTimesBoundPerBlur = 1.35;
// Without noise: of sharp edges more, of small blurred markers, whose modules run into each other, far more.
constexpr double kFloor_px = 0.0095, kSharp_px = 0.757, kSmall_px = 0.085, kSmallSide = 21;

double cube(double x) { return x * x * x; }

constexpr double kWhite = 0.88, kBlack = 0.05;
constexpr double kRootPi = 1.7724538509055160;

}  // namespace

std::array<std::array<double, 2>, 4> true_corners(const View& view) {
  const std::array<Vec3, 4> places = corner_places(view.size_m);
  std::array<std::array<double, 2>, 4> corners{};
  for (std::size_t i = 0; i < 4; ++i) corners[i] = image_of(view.camera, transform(view.pose, places[i]));
  return corners;
}

CornerNoise corner_noise(const View& view) {
  const sim::Sensor& sensor = view.sensor;
  const double swing = (sensor.white_level - sensor.black_level) * view.light;
  CornerNoise result;
  result.contrast = swing * (kWhite - kBlack);
  const double shot = sensor.full_well_e > 0 ? 0.5 * swing * (kWhite + kBlack) * 255 / sensor.full_well_e : 0;
  // A twelfth: rounding to whole grey levels; below, the pixel's square and an even motion.
  result.noise = std::sqrt(sensor.read_noise * sensor.read_noise + shot + 1.0 / 12);
  result.blur_px = std::sqrt(sensor.blur_sigma_px * sensor.blur_sigma_px + sensor.defocus_px * sensor.defocus_px / 4 +
                             (1 + view.motion_px * view.motion_px) / 12);
  // A row's place of the edge has the variance (noise / contrast)^2 2 sqrt(pi) blur at best.
  const double row_px = (kTimesBound + kTimesBoundPerBlur * result.blur_px) * result.noise / result.contrast *
                        std::sqrt(2 * kRootPi * result.blur_px);
  const auto corners = true_corners(view);
  std::array<double, 4> sides{};
  for (std::size_t k = 0; k < 4; ++k) {
    const auto& from = corners[k];
    const auto& to = corners[(k + 1) % 4];
    sides[k] = std::sqrt((to[0] - from[0]) * (to[0] - from[0]) + (to[1] - from[1]) * (to[1] - from[1]));
    result.side_px += sides[k] / 4;
  }
  result.shortest_px = *std::min_element(sides.begin(), sides.end());
  const double sharpness = std::max(1.0, kSharp_px / result.blur_px);
  const double sharp = kFloor_px * sharpness * sharpness;
  const double small = kSmall_px * cube(kSmallSide * result.blur_px / result.side_px);
  const double floor = sharp * sharp + small * small;
  double squares = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    // A line through n places over a length has the variance 1/n in its middle and three times that, by its slope, at
    // the length's ends.
    const double length = std::max(kFewestRows, sides[k] * (1 - 2 * kTrim) - 2 * kTrim_px);
    const double beyond = sides[k] / length;
    const double at_ends = 1 + 3 * beyond * beyond;
    result.shift_share[k] = 1 / at_ends;
    result.side_end_px[k] = std::sqrt(row_px * row_px * at_ends / std::min(length, kMostRows) + floor);
    squares += result.side_end_px[k] * result.side_end_px[k] / 4;
  }
  result.corner_px = std::sqrt(squares);
  return result;
}

}  // namespace berth::plan
