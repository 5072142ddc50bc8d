#pragma once

#include <array>
#include <cstddef>

#include "berth/camera.hpp"
#include "pose_algebra.hpp"
#include "sim/random.hpp"

namespace berth {

using Corners4 = std::array<std::array<double, 2>, 4>;

/// Where a marker's corners are seen, by the definition of the frames and not by Berth's table of them.
inline Corners4 seen_corners(const CameraModel& camera, const Pose& pose, double side_m) {
  const double h = side_m / 2;
  const double place[4][2] = {{-h, -h}, {-h, h}, {h, h}, {h, -h}};
  Corners4 corners;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec3 at = transform(pose, {place[i][0], place[i][1], 0});
    corners[i] = camera.project(at[0] / at[2], at[1] / at[2]);
  }
  return corners;
}

/// Near enough normal: the sum of twelve uniform numbers.
inline double normal(sim::Random& random) {
  double sum = -6;
  for (int k = 0; k < 12; ++k) sum += random.uniform(0, 1);
  return sum;
}

inline Corners4 with_noise(Corners4 corners, double deviation_px, sim::Random& random) {
  for (auto& corner : corners) {
    for (double& value : corner) value += deviation_px * normal(random);
  }
  return corners;
}

/// e' C^-1 e by elimination.
inline double mahalanobis(std::array<double, 36> c, std::array<double, 6> e) {
  const std::array<double, 6> right = e;
  for (std::size_t k = 0; k < 6; ++k) {
    for (std::size_t i = k + 1; i < 6; ++i) {
      const double factor = c[i * 6 + k] / c[k * 6 + k];
      for (std::size_t j = k; j < 6; ++j) c[i * 6 + j] -= factor * c[k * 6 + j];
      e[i] -= factor * e[k];
    }
  }
  double sum = 0;
  for (std::size_t i = 6; i-- > 0;) {
    for (std::size_t j = i + 1; j < 6; ++j) e[i] -= c[i * 6 + j] * e[j];
    e[i] /= c[i * 6 + i];
    sum += e[i] * right[i];
  }
  return sum;
}

}  // namespace berth
