#include "berth/camera.hpp"

#include <algorithm>
#include <cmath>

#include "berth/error.hpp"
#include "exact_math.hpp"

namespace berth {
namespace {

// The lens without the pinhole: where it moves the point (x, y) of the plane z = 1, and the derivative.
struct Lens {
  double x, y;
  double dx_dx, dx_dy, dy_dx, dy_dy;
};

Lens brown(const std::array<double, 8>& d, double x, double y) {
  const double k1 = d[0], k2 = d[1], p1 = d[2], p2 = d[3], k3 = d[4];
  const double r2 = x * x + y * y;
  // Without k4 … k6 the denominator is 1 and its slope 0: dividing changes no bit.
  const double below = 1 + r2 * (d[5] + r2 * (d[6] + r2 * d[7]));
  const double below_slope = d[5] + r2 * (2 * d[6] + r2 * (3 * d[7]));
  const double radial = (1 + r2 * (k1 + r2 * (k2 + r2 * k3))) / below;
  const double slope = (k1 + r2 * (2 * k2 + r2 * (3 * k3)) - radial * below_slope) / below;  // d radial / d r2
  Lens lens;
  lens.x = x * radial + 2 * p1 * x * y + p2 * (r2 + 2 * x * x);
  lens.y = y * radial + p1 * (r2 + 2 * y * y) + 2 * p2 * x * y;
  lens.dx_dx = radial + 2 * x * x * slope + 2 * p1 * y + 6 * p2 * x;
  lens.dx_dy = 2 * x * y * slope + 2 * p1 * x + 2 * p2 * y;
  lens.dy_dx = lens.dx_dy;
  lens.dy_dy = radial + 2 * y * y * slope + 6 * p1 * y + 2 * p2 * x;
  return lens;
}

// Kannala and Brandt, "A generic camera model and calibration method", PAMI 2006, eq. 6: the image's radius as a
// polynomial of the angle off the axis, and its slope.
double kannala_radius(const std::array<double, 8>& d, double angle, double& slope) {
  const double a2 = angle * angle;
  slope = 1 + a2 * (3 * d[0] + a2 * (5 * d[1] + a2 * (7 * d[2] + a2 * (9 * d[3]))));
  return angle * (1 + a2 * (d[0] + a2 * (d[1] + a2 * (d[2] + a2 * d[3]))));
}

Lens kannala(const std::array<double, 8>& d, double x, double y) {
  const double r2 = x * x + y * y;
  if (!(r2 > 1e-30)) return {x, y, 1, 0, 0, 1};  // on the axis; the rest would divide by zero
  const double r = std::sqrt(r2);
  double slope = 0;
  const double gain = kannala_radius(d, exact_atan(r), slope) / r;
  const double rise = slope / (1 + r2) - gain;  // r · d gain / d r
  const double ux = x / r, uy = y / r;
  return {x * gain, y * gain, gain + ux * ux * rise, ux * uy * rise, ux * uy * rise, gain + uy * uy * rise};
}

Lens distort(const CameraModel& camera, double x, double y) {
  return camera.lens == LensModel::equidistant ? kannala(camera.distortion, x, y) : brown(camera.distortion, x, y);
}

// Newton doubles the digits at every step; inside the image of any lens tried here six steps reach the last bit. The
// rest is for strong lenses, where the first steps only approach.
constexpr int kNewtonSteps = 16;
constexpr double kWidest_rad = 1.57;

std::array<double, 2> undo_brown(const std::array<double, 8>& d, double target_x, double target_y) {
  double x = target_x;
  double y = target_y;
  for (int step = 0; step < kNewtonSteps; ++step) {
    const Lens lens = brown(d, x, y);
    const double ex = lens.x - target_x;
    const double ey = lens.y - target_y;
    const double det = lens.dx_dx * lens.dy_dy - lens.dx_dy * lens.dy_dx;
    if (!(det > 1e-6)) break;  // the lens folds here: beyond it there is no inverse, keep the last point
    x -= (lens.dy_dy * ex - lens.dx_dy * ey) / det;
    y -= (lens.dx_dx * ey - lens.dy_dx * ex) / det;
  }
  return {x, y};
}

std::array<double, 2> undo_kannala(const std::array<double, 8>& d, double target_x, double target_y) {
  const double radius = std::sqrt(target_x * target_x + target_y * target_y);
  if (!(radius > 1e-15)) return {target_x, target_y};
  double angle = std::min(radius, kWidest_rad);
  for (int step = 0; step < kNewtonSteps; ++step) {
    double slope = 0;
    const double off = kannala_radius(d, angle, slope) - radius;
    if (!(slope > 1e-6)) break;  // the lens folds here
    angle = std::min(std::max(angle - off / slope, 0.0), kWidest_rad);
  }
  const double gain = exact_sin(angle) / exact_cos(angle) / radius;
  return {target_x * gain, target_y * gain};
}

std::string size_text(int width, int height) { return std::to_string(width) + "x" + std::to_string(height); }

}  // namespace

std::array<double, 2> CameraModel::project(double x, double y) const {
  const Lens bent = distort(*this, x, y);
  return {fx * bent.x + cx, fy * bent.y + cy};
}

std::array<double, 2> CameraModel::project(double x, double y, std::array<double, 4>& derivative) const {
  const Lens bent = distort(*this, x, y);
  derivative = {fx * bent.dx_dx, fx * bent.dx_dy, fy * bent.dy_dx, fy * bent.dy_dy};
  return {fx * bent.x + cx, fy * bent.y + cy};
}

std::array<double, 2> CameraModel::undistort(double u_px, double v_px) const {
  const double x = (u_px - cx) / fx, y = (v_px - cy) / fy;
  return lens == LensModel::equidistant ? undo_kannala(distortion, x, y) : undo_brown(distortion, x, y);
}

CameraModel paper_camera(int width, int height) {
  constexpr int kPaperWidth = 1280;
  constexpr int kPaperHeight = 960;
  if (width < 1 || height < 1 || width * kPaperHeight != height * kPaperWidth || width > 16384) {
    throw Error("paper_camera: size " + size_text(width, height) +
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
  camera.distortion = {-0.1116, 0.1242};
  return camera;
}

CameraModel resized_camera(const CameraModel& camera, int width, int height) {
  const double across = static_cast<double>(width) / camera.width, down = static_cast<double>(height) / camera.height;
  if (width < 1 || height < 1 || !(std::fabs(across * camera.height - height) <= 1)) {
    throw Error("a camera of " + size_text(camera.width, camera.height) + " is not resized to " +
                size_text(width, height) + ", of another shape; use images of the same shape, or crop");
  }
  CameraModel fitted = camera;
  fitted.width = width;
  fitted.height = height;
  fitted.fx *= across;
  fitted.fy *= down;
  fitted.cx = (camera.cx + 0.5) * across - 0.5;
  fitted.cy = (camera.cy + 0.5) * down - 0.5;
  return fitted;
}

CameraModel cropped_camera(const CameraModel& camera, int width, int height) {
  const int left = camera.width - width, top = camera.height - height;
  if (width < 1 || height < 1 || left < 0 || top < 0 || left % 2 != 0 || top % 2 != 0) {
    throw Error("an image of " + size_text(width, height) + " is not the middle of one of " +
                size_text(camera.width, camera.height) + "; use one that lacks the same number of pixels on each side");
  }
  CameraModel fitted = camera;
  fitted.width = width;
  fitted.height = height;
  fitted.cx -= 0.5 * left;
  fitted.cy -= 0.5 * top;
  return fitted;
}

}  // namespace berth
