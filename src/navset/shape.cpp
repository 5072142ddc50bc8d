#include "navset/shape.hpp"

#include <algorithm>
#include <cmath>

#include "navset/mesh.hpp"

namespace berth::navset {
namespace {

// Directions this close to a plane are moved off it: no infinity, no NaN, nothing to see.
constexpr double kParallel = 1e-12;

double away_from_zero(double x) { return std::abs(x) < kParallel ? kParallel : x; }

bool intersect_box(const Vec3& half, const Vec3& o, const Vec3& d, double t_min, double& t, Vec3& normal) {
  double enter = -1e30, leave = 1e30;
  int axis = 0;
  for (int i = 0; i < 3; ++i) {
    const double inverse = 1 / away_from_zero(d[i]);
    const double a = (-half[i] - o[i]) * inverse, b = (half[i] - o[i]) * inverse;
    const double first = std::min(a, b), last = std::max(a, b);
    if (first > enter) {
      enter = first;
      axis = i;
    }
    leave = std::min(leave, last);
  }
  if (enter > leave || enter <= t_min || enter >= t) return false;
  t = enter;
  normal = {0, 0, 0};
  normal[axis] = d[axis] > 0 ? -1 : 1;
  return true;
}

bool intersect_sphere(double radius, const Vec3& o, const Vec3& d, double t_min, double& t, Vec3& normal) {
  const double a = sim::dot(d, d), b = sim::dot(o, d), c = sim::dot(o, o) - radius * radius;
  const double discriminant = b * b - a * c;
  if (discriminant < 0) return false;
  const double place = (-b - std::sqrt(discriminant)) / a;
  if (place <= t_min || place >= t) return false;
  t = place;
  normal = sim::add(o, sim::scaled(d, t));
  return true;
}

bool intersect_flat(double z, const Vec3& o, const Vec3& d, double t_min, double t, double& place) {
  place = (z - o[2]) / away_from_zero(d[2]);
  return place > t_min && place < t;
}

bool intersect_frustum(const Vec3& size, bool capped, const Vec3& o, const Vec3& d, double t_min, double& t,
                       Vec3& normal) {
  const double h = size[2];
  bool found = false;
  if (capped) {
    for (int end = 0; end < 2; ++end) {
      double place = 0;
      if (!intersect_flat(end ? h : -h, o, d, t_min, t, place)) continue;
      const double x = o[0] + d[0] * place, y = o[1] + d[1] * place;
      if (x * x + y * y > size[end] * size[end]) continue;
      t = place;
      normal = {0, 0, end ? 1.0 : -1.0};
      found = true;
    }
  }
  // Radius r(z) = middle + slope z; the points with x² + y² = r(z)².
  const double slope = (size[1] - size[0]) / (2 * h), middle = (size[1] + size[0]) / 2;
  const double ro = middle + slope * o[2], rd = slope * d[2];
  const double a = away_from_zero(d[0] * d[0] + d[1] * d[1] - rd * rd);
  const double b = o[0] * d[0] + o[1] * d[1] - ro * rd;
  const double c = o[0] * o[0] + o[1] * o[1] - ro * ro;
  const double discriminant = b * b - a * c;
  if (discriminant < 0) return found;
  const double root = std::sqrt(discriminant);
  for (int k = 0; k < 2; ++k) {
    const double place = ((k ? root : -root) - b) / a;
    if (place <= t_min || place >= t) continue;
    const double z = o[2] + d[2] * place;
    if (z < -h || z > h) continue;
    t = place;
    normal = {o[0] + d[0] * t, o[1] + d[1] * t, -slope * (middle + slope * z)};
    found = true;
  }
  return found;
}

bool intersect_disc(const Vec3& size, bool round, const Vec3& o, const Vec3& d, double t_min, double& t, Vec3& normal) {
  double place = 0;
  if (!intersect_flat(0, o, d, t_min, t, place)) return false;
  const double x = o[0] + d[0] * place, y = o[1] + d[1] * place, square = x * x + y * y;
  const bool inside = round ? square <= size[0] * size[0] && square >= size[1] * size[1]
                            : std::abs(x) <= size[0] && std::abs(y) <= size[1];
  if (!inside) return false;
  t = place;
  normal = {0, 0, 1};
  return true;
}

// An angle without trigonometry: 0..4 once round, continuous, equal steps only nearly so.
double diamond_angle(double x, double y) {
  const double sum = std::abs(x) + std::abs(y);
  if (!(sum > 0)) return 0;
  const double part = y / sum;
  return x >= 0 ? part + 1 : 3 - part;
}

}  // namespace

bool intersect(const Shape& shape, const Vec3& o, const Vec3& d, double t_min, double& t, Vec3& normal) {
  switch (shape.kind) {
    case ShapeKind::box:
      return intersect_box(shape.size, o, d, t_min, t, normal);
    case ShapeKind::frustum:
      return intersect_frustum(shape.size, true, o, d, t_min, t, normal);
    case ShapeKind::tube:
      return intersect_frustum(shape.size, false, o, d, t_min, t, normal);
    case ShapeKind::sphere:
      return intersect_sphere(shape.size[0], o, d, t_min, t, normal);
    case ShapeKind::ring:
      return intersect_disc(shape.size, true, o, d, t_min, t, normal);
    case ShapeKind::plate:
      return intersect_disc(shape.size, false, o, d, t_min, t, normal);
    case ShapeKind::mesh:
      break;
  }
  // Origin and direction shrink alike, so that t keeps its meaning.
  const double shrink = 1 / shape.size[0];
  return shape.mesh->intersect(sim::scaled(o, shrink), sim::scaled(d, shrink), t_min, t, normal);
}

double bounding_radius(const Shape& shape) {
  const Vec3& s = shape.size;
  switch (shape.kind) {
    case ShapeKind::box:
      return sim::length(s);
    case ShapeKind::frustum:
    case ShapeKind::tube: {
      const double r = std::max(s[0], s[1]);
      return std::sqrt(r * r + s[2] * s[2]);
    }
    case ShapeKind::sphere:
    case ShapeKind::ring:
      return s[0];
    case ShapeKind::plate:
      return std::sqrt(s[0] * s[0] + s[1] * s[1]);
    case ShapeKind::mesh:
      break;
  }
  return s[0] * shape.mesh->radius();
}

Vec2 surface_coordinates(const Shape& shape, const Vec3& point, const Vec3& normal) {
  const double nx = std::abs(normal[0]), ny = std::abs(normal[1]), nz = std::abs(normal[2]);
  const bool round =
      shape.kind == ShapeKind::frustum || shape.kind == ShapeKind::tube || shape.kind == ShapeKind::sphere;
  if (round && (nx > 0 || ny > 0)) {
    const double radius = std::max(shape.size[0], shape.kind == ShapeKind::sphere ? 0.0 : shape.size[1]);
    return {diamond_angle(point[0], point[1]) * radius * (sim::kPi / 2), point[2]};
  }
  if (nx > ny && nx > nz) return {point[1], point[2]};
  if (ny > nz) return {point[0], point[2]};
  return {point[0], point[1]};
}

}  // namespace berth::navset
