#include "sim/lens.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "berth/error.hpp"

namespace berth::sim {
namespace {

struct Bent {
  double x, y;
  // Derivatives by the undistorted x and y.
  double xx, xy, yy;
};

// Brown 1966, in OpenCV's order of the coefficients.
Bent bend(const CameraModel& camera, double x, double y) {
  const double k1 = camera.distortion[0], k2 = camera.distortion[1], k3 = camera.distortion[4];
  const double p1 = camera.distortion[2], p2 = camera.distortion[3];
  const double s = x * x + y * y;
  const double gain = 1 + s * (k1 + s * (k2 + s * k3));
  const double rise = 2 * (k1 + s * (2 * k2 + s * 3 * k3));
  return {x * gain + 2 * p1 * x * y + p2 * (s + 2 * x * x), y * gain + p1 * (s + 2 * y * y) + 2 * p2 * x * y,
          gain + x * x * rise + 2 * p1 * y + 6 * p2 * x, x * y * rise + 2 * p1 * x + 2 * p2 * y,
          gain + y * y * rise + 6 * p1 * y + 2 * p2 * x};
}

// Kannala & Brandt 2006: the distance from the principal point at f = 1 of a ray `angle` off the axis, and its slope.
struct Polar {
  double distance, slope;
};

Polar fisheye(const CameraModel& camera, double angle) {
  Polar polar = {angle, 1};
  double power = angle;
  for (std::size_t i = 0; i < 4; ++i) {
    const double even = power * angle;  // angle^(2i + 2)
    polar.slope += static_cast<double>(2 * i + 3) * camera.distortion[i] * even;
    power = even * angle;
    polar.distance += camera.distortion[i] * power;
  }
  return polar;
}

// Rays (x/z, y/z) run away towards 90 degrees; up to here a pixel's stay straight enough.
constexpr double kWidest_rad = 1.45;

Vec2 fisheye_ray(const CameraModel& camera, double u, double v) {
  const double x = (u - camera.cx) / camera.fx, y = (v - camera.cy) / camera.fy;
  const double distance = std::sqrt(x * x + y * y);
  if (distance == 0) return {0, 0};
  double angle = std::min(distance, kWidest_rad);
  Polar polar{};
  for (int i = 0; i < 12; ++i) {
    polar = fisheye(camera, angle);
    angle += (distance - polar.distance) / polar.slope;
  }
  if (!(polar.slope > 0.05) || !(angle > 0 && angle <= kWidest_rad)) {
    throw Error("simulator: the fisheye folds or sees more than 83 degrees off its axis near pixel (" +
                std::to_string(u) + ", " + std::to_string(v) +
                "): raise fx and fy, weaken the distortion coefficients or make the image smaller");
  }
  const double gain = exact_sin(angle) / exact_cos(angle) / distance;
  return {gain * x, gain * y};
}

// From a neighbour's ray, half a millipixel off after the first step, Newton's method is at the last bit after three.
constexpr int kSteps = 4;
// The very first ray starts from the undistorted guess.
constexpr int kFirstSteps = 30;

}  // namespace

Vec2 image_point(const CameraModel& camera, const Vec2& ray) {
  if (camera.lens == LensModel::equidistant) {
    const double tangent = std::sqrt(ray[0] * ray[0] + ray[1] * ray[1]);
    const double gain = tangent > 0 ? fisheye(camera, exact_atan(tangent)).distance / tangent : 1;
    return {camera.fx * gain * ray[0] + camera.cx, camera.fy * gain * ray[1] + camera.cy};
  }
  const Bent bent = bend(camera, ray[0], ray[1]);
  return {camera.fx * bent.x + camera.cx, camera.fy * bent.y + camera.cy};
}

RayMap::RayMap(const CameraModel& camera) : camera_(camera) {
  const int width = camera.width, height = camera.height;
  if (width < 1 || height < 1 || width > 16384 || height > 16384) {
    throw Error("simulator: camera size " + std::to_string(width) + "x" + std::to_string(height) +
                " is outside 1x1 to 16384x16384");
  }
  if (!(camera.fx > 0) || !(camera.fy > 0)) throw Error("simulator: the camera's focal lengths must be above zero");
  const auto& d = camera.distortion;
  if (camera.lens == LensModel::radial_tangential && (d[5] != 0 || d[6] != 0 || d[7] != 0)) {
    throw Error("simulator: no rational lens here: give a camera without k4, k5 and k6");
  }
  corners_.resize(static_cast<std::size_t>(width + 1) * static_cast<std::size_t>(height + 1));

  const auto solve = [&](Vec2 guess, double u, double v, int steps) {
    const double x = (u - camera.cx) / camera.fx, y = (v - camera.cy) / camera.fy;
    Bent bent{};
    for (int i = 0; i < steps; ++i) {
      bent = bend(camera, guess[0], guess[1]);
      const double det = bent.xx * bent.yy - bent.xy * bent.xy;
      const double ex = x - bent.x, ey = y - bent.y;
      guess = {guess[0] + (bent.yy * ex - bent.xy * ey) / det, guess[1] + (bent.xx * ey - bent.xy * ex) / det};
      if (!(det > 0.05) || !(bent.xx > 0)) {
        throw Error("simulator: the lens folds inside the image near pixel (" + std::to_string(u) + ", " +
                    std::to_string(v) + "): weaken the distortion coefficients or make the image smaller");
      }
    }
    return guess;
  };
  const auto at = [&](int column, int row) -> Vec2& {
    return corners_[static_cast<std::size_t>(row) * static_cast<std::size_t>(width + 1) +
                    static_cast<std::size_t>(column)];
  };
  if (camera.lens == LensModel::equidistant) {
    for (int r = 0; r <= height; ++r) {
      for (int c = 0; c <= width; ++c) at(c, r) = fisheye_ray(camera, c - 0.5, r - 0.5);
    }
    set_bounds();
    return;
  }
  // Outwards from the principal point, where every lens is mild: each corner starts from its inner neighbour.
  const int middle_column = std::min(width, std::max(0, static_cast<int>(camera.cx)));
  const int middle_row = std::min(height, std::max(0, static_cast<int>(camera.cy)));
  const auto fill_row = [&](int row) {
    for (int c = middle_column - 1; c >= 0; --c) at(c, row) = solve(at(c + 1, row), c - 0.5, row - 0.5, kSteps);
    for (int c = middle_column + 1; c <= width; ++c) at(c, row) = solve(at(c - 1, row), c - 0.5, row - 0.5, kSteps);
  };
  at(middle_column, middle_row) =
      solve(Vec2{(middle_column - 0.5 - camera.cx) / camera.fx, (middle_row - 0.5 - camera.cy) / camera.fy},
            middle_column - 0.5, middle_row - 0.5, kFirstSteps);
  fill_row(middle_row);
  for (int step : {-1, 1}) {
    for (int r = middle_row + step; r >= 0 && r <= height; r += step) {
      at(middle_column, r) = solve(at(middle_column, r - step), middle_column - 0.5, r - 0.5, kSteps);
      fill_row(r);
    }
  }
  set_bounds();
}

RayMap RayMap::part(int left, int top, int width, int height) const {
  RayMap result;
  result.camera_ = camera_;
  result.camera_.width = width;
  result.camera_.height = height;
  result.camera_.cx -= left;
  result.camera_.cy -= top;
  for (int row = top; row <= top + height; ++row) {
    const Vec2* const first = &corner(left, row);
    result.corners_.insert(result.corners_.end(), first, first + width + 1);
  }
  result.set_bounds();
  return result;
}

void RayMap::set_bounds() {
  low_ = high_ = corners_[0];
  for (const Vec2& corner : corners_) {
    for (std::size_t i = 0; i < 2; ++i) {
      low_[i] = std::min(low_[i], corner[i]);
      high_[i] = std::max(high_[i], corner[i]);
    }
  }
}

}  // namespace berth::sim
