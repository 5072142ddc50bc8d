#pragma once

#include <array>
#include <vector>

#include "sim/geometry.hpp"
#include "sim/scene.hpp"

namespace berth::sim {

/// Smooth random texture with mean 0 and values in −1 … 1; `x`, `y` in wavelengths. The same everywhere and always.
double grain(double x, double y);

/// What a ray sees: the surface's albedo and the cosine between its normal and the direct light.
struct Seen {
  double albedo = 0;
  double facing = 0;
};

/// A Surface at one instant, ready for rays (x, y, 1).
class Layer {
 public:
  Layer(const Surface& surface, const Pose& pose, const Vec3& to_light);

  /// Seen from the front, and not wholly behind the camera.
  bool visible() const { return visible_; }
  bool disc() const { return surface_->outer_radius > 0; }
  const Surface& surface() const { return *surface_; }
  /// The ray box that holds all of it.
  const Vec2& low() const { return low_; }
  const Vec2& high() const { return high_; }
  /// Straight sides of the outline as lines in ray space, ≥ 0 inside.
  int sides() const { return sides_; }
  const Vec3& side(int i) const { return side_[static_cast<std::size_t>(i)]; }
  /// The line x = value (y = value) of the plane as a line in ray space, ≥ 0 on the greater side.
  Vec3 line_x(double value) const { return add(to_x_, scaled(to_w_, -value)); }
  Vec3 line_y(double value) const { return add(to_y_, scaled(to_w_, -value)); }

  /// The point of the plane that the ray meets.
  Vec2 plane_point(const Vec2& ray) const {
    const double w = to_w_[0] * ray[0] + to_w_[1] * ray[1] + to_w_[2];
    return {(to_x_[0] * ray[0] + to_x_[1] * ray[1] + to_x_[2]) / w,
            (to_y_[0] * ray[0] + to_y_[1] * ray[1] + to_y_[2]) / w};
  }
  /// Point of the plane in the camera frame.
  Vec3 camera_point(const Vec2& plane) const;
  bool hit(const Vec2& ray) const;
  /// What a ray that hits sees.
  Seen look(const Vec2& ray) const;

 private:
  const Surface* surface_;
  Pose pose_;
  // Rows of the map from rays to (x, y, 1) / depth of the plane.
  Vec3 to_x_{}, to_y_{}, to_w_{};
  std::array<Vec3, kMaxOutline + 1> side_{};
  int sides_ = 0;
  Vec2 low_{}, high_{};
  double facing_ = 0;
  bool visible_ = false;
};

/// The points of the polygon (camera frame) at or beyond the near plane, cut there.
std::vector<Vec3> cut_near(const std::vector<Vec3>& polygon);
constexpr double kNear_m = 0.005;

}  // namespace berth::sim
