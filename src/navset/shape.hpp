#pragma once

#include "sim/geometry.hpp"

namespace berth::navset {

using sim::Mat3;
using sim::Vec2;
using sim::Vec3;

class Mesh;

enum class ShapeKind : u8 {
  box,      ///< size = half extents
  frustum,  ///< closed, along z; size = radius at -z, radius at +z, half length
  tube,     ///< a frustum without its end discs
  sphere,   ///< size[0] = radius
  ring,     ///< flat, in z = 0; size = outer radius, inner radius
  plate,    ///< flat, in z = 0; size = half width, half height
  mesh      ///< size[0] = scale
};

struct Shape {
  ShapeKind kind = ShapeKind::box;
  Vec3 size{};
  const Mesh* mesh = nullptr;
};

/// The first point of the ray origin + t · direction with t_min < t < `t`. Where there is one, `t` becomes its place
/// and `normal` the surface's normal there, of any length and on either side. All in the shape's frame.
bool intersect(const Shape& shape, const Vec3& origin, const Vec3& direction, double t_min, double& t, Vec3& normal);

/// Radius of a sphere around the shape's origin that holds it.
double bounding_radius(const Shape& shape);

/// Coordinates on the surface, metres: two of the point's own on flat faces, round a frustum or sphere the way along
/// it.
Vec2 surface_coordinates(const Shape& shape, const Vec3& point, const Vec3& normal);

}  // namespace berth::navset
