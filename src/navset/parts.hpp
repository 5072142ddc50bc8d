#pragma once

#include "navset/scene.hpp"

namespace berth::navset {

// Rotations whose local z becomes the named axis.
constexpr Mat3 kAlongX = {0, 0, 1, 0, 1, 0, -1, 0, 0};
constexpr Mat3 kAlongY = {1, 0, 0, 0, 0, 1, 0, -1, 0};
constexpr Mat3 kAlongZ = {1, 0, 0, 0, 1, 0, 0, 0, 1};
constexpr Mat3 kAgainstX = {0, 0, -1, 0, 1, 0, 1, 0, 0};
constexpr Mat3 kAgainstY = {1, 0, 0, 0, 0, -1, 0, 1, 0};
constexpr Mat3 kAgainstZ = {1, 0, 0, 0, -1, 0, 0, 0, -1};

inline Part part(ShapeKind kind, const Vec3& size, const Vec3& at, const Material& material,
                 const Mat3& rotation = kAlongZ) {
  Part result;
  result.shape.kind = kind;
  result.shape.size = size;
  result.material = material;
  result.pose.R = rotation;
  result.pose.t = at;
  return result;
}
inline Part box(const Vec3& half, const Vec3& at, const Material& material, const Mat3& rotation = kAlongZ) {
  return part(ShapeKind::box, half, at, material, rotation);
}
inline Part cylinder(double radius, double half_length, const Vec3& at, const Material& material,
                     const Mat3& rotation) {
  return part(ShapeKind::frustum, {radius, radius, half_length}, at, material, rotation);
}
inline Part sphere(double radius, const Vec3& at, const Material& material) {
  return part(ShapeKind::sphere, {radius, radius, radius}, at, material);
}

inline Material plain(double albedo, double specular = 0.1, int gloss = 4) {
  Material m;
  m.albedo = albedo;
  m.specular = specular;
  m.gloss = gloss;
  return m;
}
inline Material textured(Texture texture, double albedo, double second, double scale, u64 seed) {
  Material m = plain(albedo);
  m.texture = texture;
  m.second = second;
  m.scale = scale;
  m.seed = seed;
  return m;
}
/// Crumpled multi-layer insulation: mostly mirror.
inline Material foil(double albedo, double facet, u64 seed) {
  Material m = textured(Texture::foil, albedo, albedo, facet, seed);
  m.specular = 0.9;
  m.gloss = 5;
  m.mirror = 0.45;
  return m;
}
inline Material solar_cells(double albedo, double lines, double cell, u64 seed) {
  Material m = textured(Texture::cells, albedo, lines, cell, seed);
  m.specular = 0.6;
  m.gloss = 6;
  m.mirror = 0.08;
  return m;
}
inline Material metal(double albedo) {
  Material m = plain(albedo, 0.7, 5);
  m.mirror = 0.25;
  return m;
}

/// Uniform over all attitudes.
Mat3 random_attitude(sim::Random& random);
/// Uniform over all directions.
Vec3 random_direction(sim::Random& random);
/// Between low and high > 0, evenly in the logarithm.
double log_uniform(sim::Random& random, double low, double high);
/// One of them, each as likely.
template <class T>
const T& pick(sim::Random& random, const std::vector<T>& from) {
  return from[static_cast<std::size_t>(random.integer(0, static_cast<int>(from.size()) - 1))];
}

}  // namespace berth::navset
