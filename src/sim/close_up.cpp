#include "sim/close_up.hpp"

#include "exact_math.hpp"
#include "sim/random.hpp"

namespace berth::sim {

Scene close_up_scene(const CameraModel& camera, const CloseUp& what, int index) {
  constexpr double kSize_m = 0.1;
  Random random(scatter(static_cast<u64>(index)) ^ static_cast<u64>(what.side_px * 16 + what.noise));
  const double tilt = radians(random.uniform(0, what.most_tilt_deg));
  const double axis = random.uniform(0, 2 * kPi), roll = random.uniform(0, 2 * kPi);
  // Half the diagonal of the marker with its light margin, and room for the blur.
  const double reach = 0.9 * what.side_px + 6;
  Vec2 pixel = {random.uniform(reach, camera.width - 1 - reach), random.uniform(reach, camera.height - 1 - reach)};
  const int border = random.integer(0, 3);
  if (what.at_border) {
    const std::size_t across = border % 2 == 0 ? 0 : 1;
    const double size = across == 0 ? camera.width : camera.height;
    pixel[across] = border < 2 ? reach : size - 1 - reach;
  }
  const std::array<double, 2> point = camera.undistort(pixel[0], pixel[1]);
  const Vec3 ray = {point[0], point[1], 1};
  const Vec3 z = normalized(ray), across = normalized(cross({0, 1, 0}, z)), down = cross(z, across);
  const Mat3 look = {across[0], down[0], z[0], across[1], down[1], z[1], across[2], down[2], z[2]};

  Scene scene;
  scene.void_albedo = 0.3;
  SceneMarker marker;
  marker.id = random.integer(0, 586);
  marker.size_m = kSize_m;
  marker.pose.R = product(look, product(rotation_z(axis), product(rotation_x(tilt), rotation_z(roll - axis))));
  marker.pose.t = scaled(ray, camera.fx * kSize_m / what.side_px);
  marker.plate_m = kSize_m / 20;
  scene.markers.push_back(marker);
  scene.sensor.blur_sigma_px = 0.6;
  scene.sensor.full_well_e = 0;
  scene.sensor.read_noise = what.noise;
  scene.seed = random.bits();

  const int half = static_cast<int>(reach) + 12;
  scene.camera = camera;
  scene.camera.width = scene.camera.height = 2 * half;
  scene.camera.cx -= static_cast<double>(floor_int(pixel[0]) - half);
  scene.camera.cy -= static_cast<double>(floor_int(pixel[1]) - half);
  return scene;
}

}  // namespace berth::sim
