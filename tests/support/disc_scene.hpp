#pragma once

#include <algorithm>
#include <array>
#include <cmath>

#include "berth/camera.hpp"
#include "berth/disc_target.hpp"
#include "sim/geometry.hpp"
#include "sim/random.hpp"
#include "sim/scene.hpp"

namespace berth::test {

/// The upper left of what the paper's camera sees, where its lens bends most.
inline CameraModel corner_camera(int width, int height) {
  CameraModel camera = paper_camera();
  camera.width = width;
  camera.height = height;
  return camera;
}

/// A target's pose about the middle of a camera's image, its discs `disc_px` across, tilted by up to `tilt_deg` about
/// an axis in its plane and turned anyhow.
inline Pose random_target_pose(const CameraModel& camera, const DiscTarget& target, double disc_px, double tilt_deg,
                               sim::Random& random) {
  const double about = random.uniform(-kPi, kPi), tilt = random.uniform(0, radians(tilt_deg));
  const double turn = random.uniform(-kPi, kPi), aside_x = random.uniform(-3, 3), aside_y = random.uniform(-3, 3);
  Pose pose;
  pose.R = product(sim::rotation_z(about), product(sim::rotation_x(tilt), sim::rotation_z(turn - about)));
  const double z = camera.fx * target.discs[0].diameter_m / disc_px;
  const Vec2 middle = camera.undistort(camera.width / 2.0 + aside_x, camera.height / 2.0 + aside_y);
  pose.t = {middle[0] * z, middle[1] * z, z};
  return pose;
}

/// A frame of one target on its plate, with the given blur (px) and noise (grey levels) alone.
inline sim::Scene target_scene(const CameraModel& camera, const DiscTarget& target, const Pose& pose, double blur_px,
                               double noise, u64 seed) {
  sim::Scene scene;
  scene.camera = camera;
  scene.void_albedo = 0.3;
  sim::SceneTarget one;
  one.target = target;
  one.pose = pose;
  scene.targets = {one};
  scene.sensor.blur_sigma_px = blur_px;
  scene.sensor.read_noise = noise;
  scene.sensor.full_well_e = 1e7;
  scene.sensor.vignetting = 0;
  scene.seed = seed;
  return scene;
}

/// The centre of a disc's ellipse in the plane z = 1: the middle between the extremes of 3600 points of its outline.
inline Vec2 ellipse_center(const Pose& pose, const TargetDisc& disc) {
  Vec2 low = {1e9, 1e9}, high = {-1e9, -1e9};
  for (int i = 0; i < 3600; ++i) {
    const double angle = 2 * kPi * i / 3600, r = disc.diameter_m / 2;
    const Vec3 at = transform(pose, {disc.x_m + r * exact_cos(angle), disc.y_m + r * exact_sin(angle), 0});
    for (std::size_t k = 0; k < 2; ++k) {
      low[k] = std::min(low[k], at[k] / at[2]);
      high[k] = std::max(high[k], at[k] / at[2]);
    }
  }
  return {(low[0] + high[0]) / 2, (low[1] + high[1]) / 2};
}

}  // namespace berth::test
