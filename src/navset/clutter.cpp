#include "navset/things.hpp"

namespace berth::navset {
namespace {

// A random number is never drawn in two arguments of one call: their order differs from compiler to compiler.
using sim::Random;

Material any(Random& random) {
  const double tone = random.uniform(0.04, 0.92), second = random.uniform(0.04, 0.92),
               size = random.uniform(0.02, 0.12);
  switch (random.integer(0, 7)) {
    case 0:
      return textured(Texture::panels, tone, second, size, random.bits());
    case 1:
      return textured(Texture::bands, tone, second, size, random.bits());
    case 2:
      return textured(Texture::checks, tone, second, size, random.bits());
    case 3:
      return textured(Texture::grain, tone, second, size, random.bits());
    case 4:
      return textured(Texture::racks, tone, second, 0.05 + size, random.bits());
    case 5:
      return metal(tone);
    default:
      return plain(tone, random.uniform(0, 0.5));
  }
}

Vec3 half_sides(Random& random, double low, double high) {
  const double x = random.uniform(low, high), y = random.uniform(low, high), z = random.uniform(low, high);
  return {x, y, z};
}

Mat3 upright(Random& random) { return sim::rotation_y(random.uniform(0, 2 * sim::kPi)); }

Model crates(Random& random) {
  Model model;
  const int count = random.integer(1, 4);
  double top = 0.12;
  for (int i = 0; i < count; ++i) {
    const Vec3 half = half_sides(random, 0.03, 0.12);
    const Vec3 at{random.uniform(-0.05, 0.05), top - half[1], random.uniform(-0.05, 0.05)};
    const Material side = any(random);
    model.push_back(box(half, at, side, upright(random)));
    top -= 2 * half[1];
  }
  return model;
}

Model lamp(Random& random) {
  const double tilt = random.uniform(-0.6, 0.6);
  Material bulb = plain(0.9);
  bulb.glow = random.uniform(0, 1.5);
  Model model{cylinder(0.006, 0.15, {0, 0.05, 0}, plain(0.1, 0.4), kAlongY)};
  const Mat3 head = sim::product(sim::rotation_x(tilt), kAgainstZ);
  model.push_back(part(ShapeKind::tube, {0.03, 0.07, 0.05}, {0, -0.12, 0}, plain(random.uniform(0.05, 0.8)), head));
  model.push_back(
      part(ShapeKind::ring, {0.055, 0, 0}, sim::add({0, -0.12, 0}, sim::product(head, Vec3{0, 0, 0.03})), bulb, head));
  for (int i = 0; i < 3; ++i) {
    const Mat3 turn = sim::product(sim::rotation_y(2 * sim::kPi * i / 3), sim::product(sim::rotation_z(0.5), kAlongY));
    model.push_back(
        cylinder(0.004, 0.06, sim::add({0, 0.2, 0}, sim::product(turn, Vec3{0, 0, 0.05})), plain(0.1), turn));
  }
  return model;
}

Model drums(Random& random) {
  Model model;
  const int count = random.integer(1, 3);
  for (int i = 0; i < count; ++i) {
    const double radius = random.uniform(0.03, 0.1), half = random.uniform(0.04, 0.15);
    const Material side = any(random);
    const Mat3 turn = random.chance(0.6) ? kAlongY : random_attitude(random);
    model.push_back(cylinder(radius, half, {0.16 * i - 0.1, 0, random.uniform(-0.1, 0.1)}, side, turn));
  }
  return model;
}

Model heap(Random& random) {
  Model model;
  const int count = random.integer(3, 8);
  for (int i = 0; i < count; ++i) {
    const Vec3 at{random.uniform(-0.16, 0.16), random.uniform(-0.16, 0.16), random.uniform(-0.1, 0.1)};
    const Material look = any(random);
    const Mat3 turn = random_attitude(random);
    switch (random.integer(0, 3)) {
      case 0:
        model.push_back(sphere(random.uniform(0.02, 0.08), at, look));
        break;
      case 1: {
        const double radius = random.uniform(0.01, 0.05), half = random.uniform(0.03, 0.12);
        model.push_back(cylinder(radius, half, at, look, turn));
        break;
      }
      default:
        model.push_back(box(half_sides(random, 0.01, 0.1), at, look, turn));
        break;
    }
  }
  return model;
}

// A table with things on it.
Model table(Random& random) {
  const Material top = any(random);
  Model model{box({0.22, 0.008, 0.14}, {0, 0, 0}, top)};
  for (int i = 0; i < 4; ++i) {
    model.push_back(
        box({0.008, 0.09, 0.008}, {(i & 1) != 0 ? 0.2 : -0.2, 0.1, (i & 2) != 0 ? 0.12 : -0.12}, metal(0.5)));
  }
  const int count = random.integer(1, 4);
  for (int i = 0; i < count; ++i) {
    const Vec3 half = half_sides(random, 0.015, 0.06);
    const Vec3 at{random.uniform(-0.15, 0.15), -0.008 - half[1], random.uniform(-0.08, 0.08)};
    const Material look = any(random);
    model.push_back(box(half, at, look, upright(random)));
  }
  return model;
}

Model sign(Random& random) {
  const int id = random.integer(5, 500);
  Model model{tag_plate(id, 0.09, {0, 0, -0.006}, kAgainstZ), box({0.12, 0.12, 0.005}, {0, 0, 0}, any(random))};
  return model;
}

Model arm(Random& random) {
  const Material link = plain(random.uniform(0.15, 0.9), 0.4), joint = plain(random.uniform(0.05, 0.5), 0.4);
  Model model{cylinder(0.05, 0.03, {0, 0.2, 0}, joint, kAlongY)};
  Vec3 at{0, 0.17, 0};
  double pitch = random.uniform(-0.5, 0.5);
  const double yaw = random.uniform(0, 2 * sim::kPi);
  const int links = random.integer(2, 4);
  for (int i = 0; i < links; ++i) {
    const double half = random.uniform(0.04, 0.09), thick = 0.032 - 0.005 * i;
    // Local z along the link, up at first.
    const Mat3 turn = sim::product(sim::rotation_y(yaw), sim::product(sim::rotation_z(pitch), kAgainstY));
    const Vec3 along = sim::column(turn, 2);
    model.push_back(sphere(1.2 * thick, at, joint));
    model.push_back(cylinder(thick, half, sim::add(at, sim::scaled(along, half)), link, turn));
    at = sim::add(at, sim::scaled(along, 2 * half));
    pitch += random.uniform(0.2, 1.3);
  }
  for (int i = -1; i <= 1; i += 2)
    model.push_back(box({0.006, 0.03, 0.012}, sim::add(at, {0.02 * i, -0.01, 0}), joint));
  return model;
}

Model rover(Random& random) {
  const Material hull = any(random);
  Model model{box({0.13, 0.04, 0.08}, {0, 0, 0}, hull), cylinder(0.008, 0.07, {0.08, -0.1, 0}, metal(0.5), kAlongY),
              box({0.03, 0.018, 0.02}, {0.08, -0.18, 0}, plain(0.2, 0.4))};
  for (int i = 0; i < 6; ++i) {
    const int axle = i / 2 - 1;
    const double x = 0.1 * axle, z = (i & 1) != 0 ? 0.1 : -0.1;
    model.push_back(cylinder(0.038, 0.02, {x, 0.055, z}, plain(0.06), kAlongZ));
  }
  if (random.chance(0.5)) model.push_back(box({0.1, 0.002, 0.07}, {-0.03, -0.06, 0}, solar_cells(0.1, 0.5, 0.03, 3)));
  return model;
}

// A cube with round corners and fan grilles, as free flyers inside stations are.
Model free_flyer(Random& random) {
  const double half = random.uniform(0.09, 0.13);
  const Material hull = plain(random.uniform(0.15, 0.85), 0.2), bumper = plain(random.uniform(0.05, 0.9), 0.2);
  Model model{box({half, 0.9 * half, 0.9 * half}, {0, 0, 0}, hull)};
  for (int i = 0; i < 8; ++i) {
    model.push_back(sphere(0.3 * half,
                           {(i & 1) != 0 ? half * 0.9 : -half * 0.9, (i & 2) != 0 ? half * 0.85 : -half * 0.85,
                            (i & 4) != 0 ? half * 0.85 : -half * 0.85},
                           bumper));
  }
  for (int side = -1; side <= 1; side += 2) {
    model.push_back(
        cylinder(0.55 * half, 0.01, {side * half, 0, 0}, textured(Texture::checks, 0.05, 0.3, 0.012, 1), kAlongX));
  }
  model.push_back(cylinder(0.02, 0.01, {0.04, 0, -0.9 * half}, plain(0.02, 0.8, 6), kAlongZ));
  model.push_back(box({0.03, 0.02, 0.004}, {-0.04, 0.02, -0.9 * half}, plain(0.9)));
  return model;
}

}  // namespace

Model clutter(Random& random) {
  using Make = Model (*)(Random&);
  static constexpr Make kMakes[] = {crates, lamp, drums, heap, table, sign, crates};
  const auto which = static_cast<std::size_t>(random.integer(0, 6));
  return kMakes[which](random);
}

Model robot(Random& random) {
  switch (random.integer(0, 2)) {
    case 0:
      return arm(random);
    case 1:
      return rover(random);
    default:
      return free_flyer(random);
  }
}

Model decoy(const Livery& livery, Random& random) {
  const u64 seed = random.bits();
  const Material skin = livery.body == Texture::foil
                            ? foil(livery.body_albedo, 0.018, seed)
                            : textured(livery.body, livery.body_albedo, livery.body_second, 0.05, seed);
  const Material cells = solar_cells(livery.cell, livery.line, 0.0157, seed + 1), trim = plain(livery.trim, 0.3);
  Model model;
  switch (random.integer(0, 4)) {
    case 0:  // the body's sheets on a plain box
      model = {box(half_sides(random, 0.05, 0.14), {0, 0, 0}, skin)};
      break;
    case 1: {  // a wing's cells all round a drum
      const double radius = random.uniform(0.05, 0.09), half = random.uniform(0.05, 0.13);
      model = {cylinder(radius, half, {0, 0, 0}, cells, kAlongZ),
               cylinder(0.03, 0.02, {0, 0, -half - 0.01}, metal(livery.ring), kAlongZ)};
      break;
    }
    case 2:  // a flat board of cells with a frame
      model = {box({random.uniform(0.1, 0.18), random.uniform(0.05, 0.1), 0.003}, {0, 0, 0}, cells),
               box({0.01, 0.12, 0.006}, {0, 0, 0.006}, trim)};
      break;
    case 3:  // a ball in foil
      model = {sphere(random.uniform(0.06, 0.12), {0, 0, 0}, skin)};
      break;
    default:  // a board with a marker plate and two lamps
      model = {box({0.13, 0.1, 0.006}, {0, 0, 0.008}, plain(livery.deck)), tag_plate(1, 0.05, {0, 0, 0}, kAgainstZ),
               cylinder(0.02, 0.015, {0.1, 0, 0}, metal(livery.ring), kAlongZ),
               cylinder(0.02, 0.015, {-0.1, 0, 0}, metal(livery.ring), kAlongZ)};
      break;
  }
  return model;
}

Model obstacle(Random& random) {
  const Material look = any(random);
  switch (random.integer(0, 3)) {
    case 0:  // a strut right across
      return {box({random.uniform(0.01, 0.05), 1.2, random.uniform(0.005, 0.03)}, {0, 0, 0}, look)};
    case 1:  // a cable
      return {cylinder(random.uniform(0.004, 0.015), 1.2, {0, 0, 0}, look, kAlongY)};
    case 2:  // the edge of a plate
      return {box({0.3, random.uniform(0.1, 0.4), 0.008}, {0.3, 0, 0}, look)};
    default:
      return heap(random);
  }
}

}  // namespace berth::navset
