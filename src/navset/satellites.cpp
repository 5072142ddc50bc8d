#include "navset/things.hpp"

namespace berth::navset {
namespace {

using sim::Random;

Material skin(Random& random) {
  const double tone = random.uniform(0.08, 0.9);
  const double size = random.uniform(0.015, 0.05);
  switch (random.integer(0, 5)) {
    case 0:
    case 1:
      return foil(tone, size, random.bits());
    case 2:
      return textured(Texture::panels, tone, 0.15, 0.04 + size, random.bits());
    case 3:
      return solar_cells(0.12, 0.5, 0.02, random.bits());
    case 4:
      return textured(Texture::bands, tone, 0.3, 0.03 + size, random.bits());
    default:
      return plain(tone, 0.2);
  }
}

Material cells(Random& random) {
  const double tone = random.uniform(0.05, 0.2), lines = random.uniform(0.3, 0.6), size = random.uniform(0.01, 0.03);
  return solar_cells(tone, lines, size, random.bits());
}

// A wing along `side` · x from `root`, of `count` panels.
void add_wing(Model& model, int side, double root, int count, double length, double width, const Material& material) {
  model.push_back(cylinder(0.004, 0.02, {side * root, 0, 0}, plain(0.4, 0.4), kAlongX));
  for (int i = 0; i < count; ++i) {
    const double x = root + 0.02 + length * (i + 0.5);
    model.push_back(box({0.48 * length, 0.002, width}, {side * x, 0, 0}, material));
  }
}

// A big drum with long thin wings.
Model communications(Random& random) {
  const double radius = random.uniform(0.05, 0.08), half = random.uniform(0.06, 0.11);
  Model model{cylinder(radius, half, {0, 0, 0}, skin(random), kAlongZ)};
  const Material wing = cells(random);
  const int count = random.integer(3, 5);
  const double width = random.uniform(0.025, 0.04), length = random.uniform(0.05, 0.08);
  add_wing(model, 1, radius, count, length, width, wing);
  add_wing(model, -1, radius, count, length, width, wing);
  model.push_back(part(ShapeKind::tube, {0.015, 0.07, 0.02}, {0, 0, half + 0.02}, plain(0.85, 0.3)));
  return model;
}

// A ball with whip aerials.
Model ball(Random& random) {
  const double radius = random.uniform(0.07, 0.12);
  Model model{sphere(radius, {0, 0, 0}, random.chance(0.5) ? metal(0.7) : skin(random))};
  const int count = random.integer(2, 5);
  for (int i = 0; i < count; ++i) {
    const Vec3 away = random_direction(random);
    const Vec3 side = sim::normalized(sim::cross(away, {0.31, 0.17, 0.93})), third = sim::cross(away, side);
    const Mat3 turn{side[0], third[0], away[0], side[1], third[1], away[1], side[2], third[2], away[2]};
    model.push_back(cylinder(0.003, 0.07, sim::scaled(away, radius + 0.06), plain(0.6, 0.5), turn));
  }
  return model;
}

// Stacked units with cells on all sides and perhaps flaps that stand off.
Model cubesat(Random& random) {
  const int units = random.integer(1, 6);
  const double half = 0.04, length = 0.04 * units > 0.16 ? 0.16 : 0.04 * units;
  Model model{box({half, half, length}, {0, 0, 0}, cells(random))};
  for (int i = 0; i < 4; ++i) {
    model.push_back(
        box({0.004, 0.004, length + 0.002}, {(i & 1) != 0 ? half : -half, (i & 2) != 0 ? half : -half, 0}, metal(0.7)));
  }
  const int flaps = random.integer(0, 4);
  const Material flap = cells(random);
  for (int i = 0; i < flaps; ++i) {
    const Mat3 turn = sim::product(sim::rotation_z(sim::kPi / 2 * i), sim::rotation_y(0.25));
    model.push_back(box({length, 0.035, 0.0015}, sim::product(turn, Vec3{half + length, 0, length}), flap, turn));
  }
  if (random.chance(0.5)) model.push_back(cylinder(0.002, 0.1, {0, half + 0.09, -length}, plain(0.5), kAlongY));
  return model;
}

// A telescope: a long tube with an open end and one wing.
Model telescope(Random& random) {
  const double radius = random.uniform(0.04, 0.07);
  Model model{part(ShapeKind::tube, {radius, radius, 0.13}, {0, 0, 0}, skin(random)),
              part(ShapeKind::ring, {radius, 0, 0}, {0, 0, 0.05}, plain(0.05, 0.6)),
              cylinder(1.3 * radius, 0.04, {0, 0, 0.13}, skin(random), kAlongZ),
              box({0.002, radius, radius}, {radius, 0, -0.16}, plain(0.2), sim::rotation_y(0.6))};
  const Material wing = cells(random);
  add_wing(model, 1, radius, 2, 0.06, 0.05, wing);
  if (random.chance(0.5)) add_wing(model, -1, radius, 2, 0.06, 0.05, wing);
  return model;
}

// A lattice beam with modules on it.
Model truss(Random& random) {
  Model model;
  const Material bar = metal(random.uniform(0.4, 0.8));
  for (int i = 0; i < 4; ++i) {
    model.push_back(
        cylinder(0.004, 0.2, {0, (i & 1) != 0 ? 0.025 : -0.025, (i & 2) != 0 ? 0.025 : -0.025}, bar, kAlongX));
  }
  for (int i = 0; i < 9; ++i) {
    const double x = -0.19 + 0.0475 * i;
    model.push_back(box({0.003, 0.027, 0.027}, {x, 0, 0}, bar));
  }
  const int modules = random.integer(1, 3);
  for (int i = 0; i < modules; ++i) {
    const Vec3 at{random.uniform(-0.12, 0.12), random.chance(0.5) ? 0.06 : -0.06, 0};
    const double half = random.uniform(0.04, 0.09);
    const Material hull = skin(random);
    model.push_back(cylinder(0.035, half, at, hull, random.chance(0.5) ? kAlongX : kAlongZ));
  }
  const Material wing = cells(random);
  for (int side = -1; side <= 1; side += 2) model.push_back(box({0.03, 0.1, 0.001}, {0.17 * side, 0, 0.03}, wing));
  return model;
}

// Six sides from three boxes, a wing, a dish.
Model prism(Random& random) {
  const double radius = random.uniform(0.06, 0.09), half = random.uniform(0.04, 0.1);
  const Material sheet = skin(random);
  Model model;
  for (int i = 0; i < 3; ++i) {
    model.push_back(box({0.866 * radius, 0.5 * radius, half}, {0, 0, 0}, sheet, sim::rotation_z(sim::kPi / 3 * i)));
  }
  const Material wing = cells(random);
  add_wing(model, 1, 0.866 * radius, random.integer(1, 3), 0.07, 0.06, wing);
  if (random.chance(0.4)) {
    model.push_back(part(ShapeKind::tube, {0.01, 0.05, 0.012}, {0, 0, -half - 0.02}, plain(0.8), kAgainstZ));
  }
  return model;
}

// A capsule: cone, drum, bell.
Model capsule(Random& random) {
  const double radius = random.uniform(0.06, 0.1);
  const Material hull = skin(random), trunk = skin(random);
  Model model{part(ShapeKind::frustum, {radius, 0.35 * radius, 0.05}, {0, 0, 0.1}, hull),
              cylinder(radius, 0.06, {0, 0, -0.01}, trunk, kAlongZ),
              part(ShapeKind::tube, {0.3 * radius, 0.6 * radius, 0.03}, {0, 0, -0.1}, metal(0.3), kAgainstZ)};
  if (random.chance(0.5)) {
    const Material wing = cells(random);
    for (int i = 0; i < 4; ++i) {
      const Mat3 turn = sim::rotation_z(sim::kPi / 2 * i + 0.4);
      model.push_back(box({0.06, 0.025, 0.001}, sim::product(turn, Vec3{radius + 0.06, 0, -0.05}), wing, turn));
    }
  }
  return model;
}

// Four wings in a cross on a flat body.
Model cross(Random& random) {
  const double half = random.uniform(0.03, 0.06), thick = random.uniform(0.02, 0.05);
  Model model{box({half, half, thick}, {0, 0, 0}, skin(random))};
  const Material wing = cells(random);
  const double length = random.uniform(0.05, 0.09), width = random.uniform(0.02, 0.5 * half + 0.02);
  for (int i = 0; i < 4; ++i) {
    const Mat3 turn = sim::rotation_z(sim::kPi / 2 * i);
    model.push_back(box({length, width, 0.0015}, sim::product(turn, Vec3{half + length + 0.004, 0, 0}), wing, turn));
  }
  model.push_back(cylinder(0.02, 0.03, {0, 0, -0.06}, plain(0.2), kAlongZ));
  return model;
}

}  // namespace

Model other_satellite(Random& random) {
  using Make = Model (*)(Random&);
  static constexpr Make kMakes[] = {communications, ball, cubesat, telescope, truss, prism, capsule, cross};
  const auto which = static_cast<std::size_t>(random.integer(0, 7));
  return kMakes[which](random);
}

}  // namespace berth::navset
