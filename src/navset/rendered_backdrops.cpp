#include <algorithm>
#include <cmath>

#include "navset/backdrop.hpp"
#include "navset/things.hpp"
#include "sim/sensor.hpp"

namespace berth::navset {
namespace {

using sim::Random;

GrayImage to_grey(const std::vector<double>& radiance, int side) {
  GrayImage image(side, side);
  u8* out = image.view().data;
  for (std::size_t i = 0; i < radiance.size(); ++i) {
    // A film's shoulder: lamps and walls both keep some drawing.
    const double x = std::max(0.0, radiance[i]);
    out[i] = static_cast<u8>(255 * (x < 0.7 ? x : 0.7 + 0.3 * (x - 0.7) / (x - 0.7 + 0.3)) + 0.5);
  }
  return image;
}

Material wall(Random& random) {
  const double tone = random.uniform(0.2, 0.85), second = random.uniform(0.05, 0.9), size = random.uniform(0.2, 0.9);
  switch (random.integer(0, 5)) {
    case 0:
      return textured(Texture::panels, tone, second, size, random.bits());
    case 1:
      return textured(Texture::grain, tone, second, size, random.bits());
    case 2:
      return textured(Texture::bands, tone, 0.8 * tone, 0.4 * size, random.bits());
    case 3:
      return textured(Texture::checks, tone, 0.85 * tone, size, random.bits());
    default:
      return plain(tone);
  }
}

// Gantries, curtains and pieces of equipment about a laboratory.
void furnish_lab(Scene& scene, Random& random, const Vec3& half) {
  const int beams = random.integer(1, 5);
  for (int i = 0; i < beams; ++i) {
    const double height = random.uniform(-0.9, 0.3) * half[1], depth = random.uniform(0.1, 0.9) * half[2];
    const Material bar = random.chance(0.5) ? metal(0.6) : plain(random.uniform(0.05, 0.8), 0.2);
    Model beam;
    if (random.chance(0.5)) {
      beam = {box({half[0], 0.04, 0.04}, {0, height, depth}, bar),
              box({0.05, half[1], 0.05}, {0.7 * half[0], 0, depth}, bar),
              box({0.05, half[1], 0.05}, {-0.7 * half[0], 0, depth}, bar)};
    } else {
      beam = {box({0.03, half[1], 0.03}, {random.uniform(-0.8, 0.8) * half[0], 0, depth}, bar)};
    }
    scene.place(beam, Pose{}, 1, Owner::other);
  }
  const int things = random.integer(3, 12);
  for (int i = 0; i < things; ++i) {
    Pose pose;
    const double scale = random.uniform(1.5, 4.5);
    pose.t = {random.uniform(-0.9, 0.9) * half[0], half[1] - random.uniform(0.1, 0.3) * scale,
              random.uniform(0.0, 0.9) * half[2]};
    pose.R = sim::rotation_y(random.uniform(0, 2 * sim::kPi));
    scene.place(random.chance(0.3) ? robot(random) : clutter(random), pose, scale, Owner::other);
  }
  if (random.chance(0.4)) {  // a dark curtain or a white screen
    const double tone = random.chance(0.5) ? 0.05 : 0.8;
    const Material cloth = textured(Texture::bands, tone, 0.9 * tone, 0.05, random.bits());
    const Model screen{box({random.uniform(0.5, 1.0) * half[0], half[1], 0.01}, {0, 0, 0}, cloth)};
    scene.place(screen, sim::translation(random.uniform(-1, 1) * half[0], 0, 0.92 * half[2]), 1, Owner::other);
  }
}

// A module's inside: racks on four sides, strips of light, handrails, bags, cables.
void furnish_station(Scene& scene, Random& random, const Vec3& half) {
  const double size = random.uniform(0.7, 1.2);
  for (int side = 0; side < 4; ++side) {
    const double tone = random.uniform(0.45, 0.8), second = random.uniform(0.1, 0.9);
    const Material front = textured(Texture::racks, tone, second, size, random.bits());
    const bool upright = side < 2;
    const double sign = (side & 1) != 0 ? 1 : -1;
    const Vec3 at = upright ? Vec3{sign * half[0], 0, 0} : Vec3{0, sign * half[1], 0};
    const Vec3 extent = upright ? Vec3{0.05, 0.85 * half[1], half[2]} : Vec3{0.85 * half[0], 0.05, half[2]};
    scene.place({box(extent, at, front)}, Pose{}, 1, Owner::other);
  }
  Material strip = plain(0.9);
  strip.glow = random.uniform(0.5, 1.2);
  for (int i = 0; i < 2; ++i) {
    for (int k = -2; k <= 2; ++k) {
      scene.place(
          {box({0.06, 0.06, 0.35}, {(i != 0 ? 0.9 : -0.9) * half[0], -0.9 * half[1], 1.0 * k + half[2] * 0.3}, strip)},
          Pose{}, 1, Owner::other);
    }
  }
  const Material rail = plain(random.uniform(0.2, 0.8), 0.6, 5);
  const int rails = random.integer(2, 8);
  for (int i = 0; i < rails; ++i) {
    const double side = random.chance(0.5) ? 0.93 : -0.93, at = random.uniform(-0.7, 0.7);
    const Vec3 place =
        random.chance(0.5) ? Vec3{side * half[0], at * half[1], 0} : Vec3{at * half[0], side * half[1], 0};
    const double along = random.uniform(-0.2, 0.8) * half[2];
    scene.place({cylinder(0.02, 0.25, {place[0], place[1], along}, rail, kAlongZ)}, Pose{}, 1, Owner::other);
  }
  const int things = random.integer(2, 9);
  for (int i = 0; i < things; ++i) {
    Pose pose;
    const double side = random.chance(0.5) ? 0.75 : -0.75, at = random.uniform(-0.8, 0.8);
    const double along = random.uniform(-0.1, 0.9) * half[2];
    pose.t = random.chance(0.5) ? Vec3{side * half[0], at * half[1], along} : Vec3{at * half[0], side * half[1], along};
    pose.R = random_attitude(random);
    const double scale = random.uniform(0.8, 2.5);
    scene.place(random.chance(0.7) ? clutter(random) : robot(random), pose, scale, Owner::other);
  }
  // The hatch at the end.
  const double hatch = random.uniform(0.3, 0.6) * half[1];
  scene.place({part(ShapeKind::ring, {1.3 * hatch, hatch, 0}, {0, 0, 0.98 * half[2]}, plain(0.7, 0.3)),
               part(ShapeKind::ring, {hatch, 0, 0}, {0, 0, 0.985 * half[2]}, plain(random.chance(0.5) ? 0.04 : 0.5))},
              Pose{}, 1, Owner::other);
}

std::vector<double> inside(BackdropKind kind, Random& random, int side) {
  const bool station = kind == BackdropKind::station;
  const Vec3 half = station ? Vec3{1.1, 1.1, random.uniform(2.5, 4)}
                            : Vec3{random.uniform(2, 4), random.uniform(1.3, 1.9), random.uniform(2.5, 5)};
  Scene room;
  // Six walls of their own look, each a thin box.
  for (int axis = 0; axis < 3; ++axis) {
    for (int sign = -1; sign <= 1; sign += 2) {
      Vec3 extent = half, at{0, 0, 0};
      extent[axis] = 0.02;
      at[axis] = sign * (half[axis] + 0.02);
      room.place({box(extent, at, wall(random))}, Pose{}, 1, Owner::other);
    }
  }
  if (station) {
    furnish_station(room, random, half);
  } else {
    furnish_lab(room, random, half);
  }
  // The camera looks along the room, a little aside; the scene was built about the room's middle.
  const double aside = station ? 0.5 : 0.35;
  const double pitch = random.uniform(-0.15, 0.15), yaw = random.uniform(-aside, aside),
               roll = random.uniform(-0.1, 0.1);
  Pose eye;
  eye.R = sim::rotation(pitch, yaw, station ? 10 * roll : roll);
  eye.t = {random.uniform(-0.5, 0.5) * half[0], random.uniform(-0.4, 0.4) * half[1],
           -random.uniform(0.6, 0.95) * half[2]};
  const Pose view = sim::inverse(eye);
  Scene scene;
  for (const Scene::Item& item : room.items()) {
    Part p;
    p.shape = item.shape;
    p.material = item.material;
    Pose pose;
    pose.R = item.rotation;
    pose.t = item.position;
    scene.place({p}, sim::compose(view, pose), 1, Owner::other);
  }
  const Camera camera{side, side, side * random.uniform(0.6, 1.1), 0.5 * side - 0.5, 0.5 * side - 0.5};
  Light light;
  const Vec3 lamp = sim::normalized({random.uniform(-0.6, 0.6), -1, random.uniform(-0.7, 0.3)});
  // A directional light inside a closed room would be blocked by its walls: the key is left to the fill, which is soft.
  light.key = sim::product(view.R, lamp);
  light.key_strength = 0;
  light.fill = light.key;
  light.fill_strength = random.uniform(0.3, 1.0);
  light.ambient = random.uniform(0.1, 0.6);
  light.up = sim::product(view.R, Vec3{0, -1, 0});
  std::vector<double> radiance(static_cast<std::size_t>(side) * static_cast<std::size_t>(side), 0.0);
  draw(scene, camera, light, {}, 1, radiance);
  // Unevenly lit: lamps near one wall.
  const double gx = random.uniform(-0.5, 0.5), gy = random.uniform(-0.5, 0.5);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      radiance[static_cast<std::size_t>(y) * static_cast<std::size_t>(side) + static_cast<std::size_t>(x)] *=
          1 + gx * (2.0 * x / side - 1) + gy * (2.0 * y / side - 1);
    }
  }
  return radiance;
}

void add_stars(std::vector<double>& radiance, Random& random, int side, int count) {
  for (int i = 0; i < count; ++i) {
    const double x = random.uniform(2, side - 3), y = random.uniform(2, side - 3);
    const double u = random.uniform(0, 1), brightness = 0.05 + 1.8 * u * u * u * u * u;
    const int px = static_cast<int>(x), py = static_cast<int>(y);
    for (int dy = -1; dy <= 2; ++dy) {
      for (int dx = -1; dx <= 2; ++dx) {
        const double ex = px + dx - x, ey = py + dy - y;
        const std::size_t at =
            static_cast<std::size_t>(py + dy) * static_cast<std::size_t>(side) + static_cast<std::size_t>(px + dx);
        radiance[at] += brightness * sim::exact_exp(-1.2 * (ex * ex + ey * ey));
      }
    }
  }
}

std::vector<double> stars(Random& random, int side) {
  std::vector<double> radiance(static_cast<std::size_t>(side) * static_cast<std::size_t>(side), 0.0);
  const u64 seed = random.bits();
  const double milk = random.chance(0.4) ? random.uniform(0.02, 0.15) : 0.0, slope = random.uniform(-1, 1);
  for (int y = 0; y < side && milk > 0; ++y) {
    for (int x = 0; x < side; ++x) {
      const double off = 3 * ((y - 0.5 * side) - slope * (x - 0.5 * side)) / side;
      const double band = 1 / (1 + off * off);
      const double cloud = 0.5 + 0.7 * fractal_noise(seed, 6.0 * x / side, 6.0 * y / side, 4);
      radiance[static_cast<std::size_t>(y) * static_cast<std::size_t>(side) + static_cast<std::size_t>(x)] =
          milk * band * std::max(0.0, cloud);
    }
  }
  add_stars(radiance, random, side, random.integer(20, 900));
  if (random.chance(0.25)) {  // a moon, part of it lit
    const double radius = random.uniform(0.03, 0.2) * side, cx = random.uniform(0, side), cy = random.uniform(0, side);
    const Vec3 sun = random_direction(random);
    const Vec3 key = sun[2] > 0.2 ? sim::scaled(sun, -1) : sun;
    for (int y = 0; y < side; ++y) {
      for (int x = 0; x < side; ++x) {
        const double u = (x - cx) / radius, v = (y - cy) / radius, r2 = u * u + v * v;
        if (r2 > 1) continue;
        const Vec3 normal{u, v, -std::sqrt(1 - r2)};
        const double land = 0.6 + 0.5 * fractal_noise(seed + 3, 3 * u, 3 * v, 4);
        radiance[static_cast<std::size_t>(y) * static_cast<std::size_t>(side) + static_cast<std::size_t>(x)] =
            std::max(0.0, sim::dot(normal, key)) * land;
      }
    }
  }
  return radiance;
}

// A planet's limb or its face: sea, land, clouds, a thin bright air.
std::vector<double> earth(Random& random, int side) {
  std::vector<double> radiance(static_cast<std::size_t>(side) * static_cast<std::size_t>(side), 0.0);
  add_stars(radiance, random, side, random.integer(0, 150));
  const u64 seed = random.bits();
  const double radius = side * log_uniform(random, 0.6, 5);
  const double angle = random.uniform(0, 2 * sim::kPi);
  const double height = random.uniform(-0.9, 0.35) * side;  // of the limb over the picture's middle
  const double cx = 0.5 * side + sim::exact_cos(angle) * (radius + height);
  const double cy = 0.5 * side + sim::exact_sin(angle) * (radius + height);
  Vec3 sun = random_direction(random);
  if (sun[2] > 0) sun[2] = -sun[2];
  const double air = random.uniform(0.01, 0.03) * radius, wavelength = random.uniform(2.5, 8) / side;
  const double cover = random.uniform(-0.3, 0.35), land_tone = random.uniform(0.12, 0.4);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const double dx = x - cx, dy = y - cy, r = std::sqrt(dx * dx + dy * dy);
      double& out =
          radiance[static_cast<std::size_t>(y) * static_cast<std::size_t>(side) + static_cast<std::size_t>(x)];
      const double u = dx / radius, v = dy / radius;
      const double z2 = 1 - u * u - v * v;
      const double day = std::max(0.0, sim::dot({u, v, z2 > 0 ? -std::sqrt(z2) : 0}, sun) + 0.08);
      if (r > radius) {
        const double above = (r - radius) / air;
        if (above < 8) out = std::max(out, 0.9 * day * sim::exact_exp(-above));
        continue;
      }
      // Seen on a ball the ground is squeezed towards the limb: arcsin(q) / q as a short series.
      const double q2 = u * u + v * v;
      const double stretch = 1 + q2 * (1.0 / 6 + q2 * (3.0 / 40 + q2 * (0.045 + 0.1 * q2)));
      const double gx = dx * wavelength * stretch, gy = dy * wavelength * stretch;
      const double relief = fractal_noise(seed, 0.6 * gx, 0.6 * gy, 5);
      const double warp = 0.8 * smooth_noise(seed + 5, 0.5 * gx, 0.5 * gy);
      const double cloud = fractal_noise(seed + 9, gx + warp, 1.6 * gy - warp, 5) + cover;
      double ground = relief > 0.05 ? land_tone * (1 + relief) : 0.06;
      const double veil = std::min(1.0, std::max(0.0, 2.5 * cloud));
      ground += (0.9 - ground) * veil;
      const double limb = 1 - std::min(1.0, std::sqrt(std::max(0.0, z2)) * 3);
      out = day * (ground + 0.45 * limb);
    }
  }
  return radiance;
}

std::vector<double> abstract(Random& random, int side) {
  std::vector<double> radiance(static_cast<std::size_t>(side) * static_cast<std::size_t>(side), 0.0);
  const u64 seed = random.bits();
  const double base = random.uniform(0.02, 0.8), gx = random.uniform(-0.4, 0.4), gy = random.uniform(-0.4, 0.4);
  const double amount = random.uniform(0, 0.8), wavelength = log_uniform(random, 1, 30);
  const int octaves = random.integer(1, 6);
  for (int y = 0; y < side; ++y) {
    for (int x = 0; x < side; ++x) {
      const double u = static_cast<double>(x) / side, v = static_cast<double>(y) / side;
      radiance[static_cast<std::size_t>(y) * static_cast<std::size_t>(side) + static_cast<std::size_t>(x)] =
          base + gx * (u - 0.5) + gy * (v - 0.5) +
          amount * base * fractal_noise(seed, wavelength * u, wavelength * v, octaves);
    }
  }
  return radiance;
}

}  // namespace

GrayImage render_backdrop(BackdropKind kind, u64 number, int side_px) {
  Random random(sim::scatter(0xbac4d409u) + number);
  std::vector<double> radiance;
  switch (kind) {
    case BackdropKind::earth:
      radiance = earth(random, side_px);
      break;
    case BackdropKind::stars:
      radiance = stars(random, side_px);
      break;
    case BackdropKind::abstract:
      radiance = abstract(random, side_px);
      break;
    default:
      radiance = inside(kind, random, side_px);
      break;
  }
  if (kind != BackdropKind::stars) sim::gaussian_blur(radiance, side_px, side_px, 0.6);
  return to_grey(radiance, side_px);
}

}  // namespace berth::navset
