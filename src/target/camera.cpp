#include "berth/camera.hpp"

#include "berth/error.hpp"

namespace berth {
namespace {

// The Brown model without the pinhole: where the lens moves the point (x, y) of the plane z = 1, and the derivative.
struct Lens {
  double x, y;
  double dx_dx, dx_dy, dy_dx, dy_dy;
};

Lens distort(const std::array<double, 5>& d, double x, double y) {
  const double k1 = d[0], k2 = d[1], p1 = d[2], p2 = d[3], k3 = d[4];
  const double r2 = x * x + y * y;
  const double radial = 1 + r2 * (k1 + r2 * (k2 + r2 * k3));
  const double slope = k1 + r2 * (2 * k2 + r2 * (3 * k3));  // d radial / d r2
  Lens lens;
  lens.x = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
  lens.y = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
  lens.dx_dx = radial + 2 * x * x * slope + 2 * p1 * y + 6 * p2 * x;
  lens.dx_dy = 2 * x * y * slope + 2 * p1 * x + 2 * p2 * y;
  lens.dy_dx = lens.dx_dy;
  lens.dy_dy = radial + 2 * y * y * slope + 6 * p1 * y + 2 * p2 * x;
  return lens;
}

// Newton doubles the digits at every step; inside the image of any lens tried here six steps reach the last bit. The
// rest is for strong lenses, where the first steps only approach.
constexpr int kNewtonSteps = 16;

}  // namespace

std::array<double, 2> CameraModel::project(double x, double y) const {
  const Lens lens = distort(distortion, x, y);
  return {fx * lens.x + cx, fy * lens.y + cy};
}

std::array<double, 2> CameraModel::project(double x, double y, std::array<double, 4>& derivative) const {
  const Lens lens = distort(distortion, x, y);
  derivative = {fx * lens.dx_dx, fx * lens.dx_dy, fy * lens.dy_dx, fy * lens.dy_dy};
  return {fx * lens.x + cx, fy * lens.y + cy};
}

std::array<double, 2> CameraModel::undistort(double u_px, double v_px) const {
  const double target_x = (u_px - cx) / fx;
  const double target_y = (v_px - cy) / fy;
  double x = target_x;
  double y = target_y;
  for (int step = 0; step < kNewtonSteps; ++step) {
    const Lens lens = distort(distortion, x, y);
    const double ex = lens.x - target_x;
    const double ey = lens.y - target_y;
    const double det = lens.dx_dx * lens.dy_dy - lens.dx_dy * lens.dy_dx;
    if (!(det > 1e-6)) break;  // the lens folds here: beyond it there is no inverse, keep the last point
    x -= (lens.dy_dy * ex - lens.dx_dy * ey) / det;
    y -= (lens.dx_dx * ey - lens.dy_dx * ex) / det;
  }
  return {x, y};
}

CameraModel paper_camera(int width, int height) {
  constexpr int kPaperWidth = 1280;
  constexpr int kPaperHeight = 960;
  if (width < 1 || height < 1 || width * kPaperHeight != height * kPaperWidth || width > 16384) {
    throw Error("paper_camera: size " + std::to_string(width) + "x" + std::to_string(height) +
                ": Table 2 is for a 4:3 image; ask for 1280x960, 640x480 or another 4:3 size");
  }
  // Pixel centres are at integers, so the image's edge is at -0.5 and scaling is about that point.
  const double scale = static_cast<double>(width) / kPaperWidth;
  CameraModel camera;
  camera.width = width;
  camera.height = height;
  camera.fx = 1338.84 * scale;
  camera.fy = 1345.02 * scale;
  camera.cx = (618.15 + 0.5) * scale - 0.5;
  camera.cy = (475.73 + 0.5) * scale - 0.5;
  camera.distortion = {-0.1116, 0.1242, 0, 0, 0};
  return camera;
}

}  // namespace berth
