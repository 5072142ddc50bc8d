#pragma once

#include <vector>

#include "berth/camera.hpp"
#include "sim/geometry.hpp"

namespace berth::sim {

// The simulator has its own text of the lens model: an error in the engine's must not cancel out in tests.

/// Image point (px) of the ray (x, y, 1).
Vec2 image_point(const CameraModel& camera, const Vec2& ray);

/// The rays through the corners of the pixels of a camera, computed once.
class RayMap {
 public:
  /// Throws Error where the lens is not one-to-one inside the image.
  explicit RayMap(const CameraModel& camera);

  const CameraModel& camera() const { return camera_; }
  /// Ray (x/z, y/z) through the upper left corner of pixel (column, row), that is through the image point
  /// (column − ½, row − ½); column 0 … width, row 0 … height.
  const Vec2& corner(int column, int row) const {
    return corners_[static_cast<std::size_t>(row) * static_cast<std::size_t>(camera_.width + 1) +
                    static_cast<std::size_t>(column)];
  }
  /// Those of a part of the image, the same rays: `width` × `height` pixels from (left, top), which lie inside.
  RayMap part(int left, int top, int width, int height) const;
  /// Smallest and largest x and y of all rays.
  const Vec2& low() const { return low_; }
  const Vec2& high() const { return high_; }

 private:
  RayMap() = default;
  void set_bounds();

  CameraModel camera_;
  std::vector<Vec2> corners_;
  Vec2 low_ = {0, 0}, high_ = {0, 0};
};

}  // namespace berth::sim
