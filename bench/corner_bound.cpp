#include "corner_bound.hpp"

#include <cmath>
#include <vector>

#include "berth/marker.hpp"
#include "sim/printed_marker.hpp"
#include "sim/render.hpp"

namespace berth::bench {
namespace {

constexpr std::size_t kCorners = 8, kUnknowns = 15;
using Quad = std::array<std::array<double, 2>, 4>;

// Rays to marker coordinates in modules from the pattern's middle, corners in the paper's order.
class Homography {
 public:
  Homography(const CameraModel& camera, const Quad& corners_px, double side) : camera_(camera) {
    // Eight equations u = (a x + b y + c) / (g x + h y + 1) by elimination.
    double m[8][9] = {};
    for (int i = 0; i < 4; ++i) {
      const std::size_t k = static_cast<std::size_t>(i);
      const std::array<double, 2> ray = camera.undistort(corners_px[k][0], corners_px[k][1]);
      const double x = ray[0], y = ray[1];
      const double u = (i < 2 ? -0.5 : 0.5) * side, v = (i == 0 || i == 3 ? -0.5 : 0.5) * side;
      const double rows[2][9] = {{x, y, 1, 0, 0, 0, -u * x, -u * y, u}, {0, 0, 0, x, y, 1, -v * x, -v * y, v}};
      for (int r = 0; r < 2; ++r) {
        for (int c = 0; c < 9; ++c) m[2 * i + r][c] = rows[r][c];
      }
    }
    for (int k = 0; k < 8; ++k) {
      int pivot = k;
      for (int r = k + 1; r < 8; ++r) {
        if (std::fabs(m[r][k]) > std::fabs(m[pivot][k])) pivot = r;
      }
      for (int c = 0; c < 9; ++c) std::swap(m[k][c], m[pivot][c]);
      for (int r = 0; r < 8; ++r) {
        if (r == k) continue;
        const double factor = m[r][k] / m[k][k];
        for (int c = k; c < 9; ++c) m[r][c] -= factor * m[k][c];
      }
    }
    for (int k = 0; k < 8; ++k) h_[k] = m[k][8] / m[k][k];
  }
  std::array<double, 2> operator()(double x_px, double y_px) const {
    const std::array<double, 2> ray = camera_.undistort(x_px, y_px);
    const double z = h_[6] * ray[0] + h_[7] * ray[1] + 1;
    return {(h_[0] * ray[0] + h_[1] * ray[1] + h_[2]) / z, (h_[3] * ray[0] + h_[4] * ray[1] + h_[5]) / z};
  }

 private:
  const CameraModel& camera_;
  double h_[8] = {};
};

double share_below(double t) { return 0.5 * std::erfc(-t / std::sqrt(2.0)); }

// The printed pattern, blurred: 0 dark, 1 light.
class Pattern {
 public:
  explicit Pattern(int id)
      : family_(family("tag36h11")),
        side_(family_.total_width + 2),
        cells_(sim::pattern_cells(family_, family_.codes[static_cast<std::size_t>(id)], 1, 0)) {}
  double border() const { return family_.border_width; }
  /// Half the width of the pattern with its light ring.
  double half() const { return family_.total_width / 2.0; }
  double at(const std::array<double, 2>& p, double deviation_u, double deviation_v) const {
    double sum = 0;
    for (int row = 0; row < side_; ++row) {
      const double low = row - 0.5 * side_ - p[1];
      if (low > 6 * deviation_v || low + 1 < -6 * deviation_v) continue;
      const double weight = share_below((low + 1) / deviation_v) - share_below(low / deviation_v);
      for (int column = 0; column < side_; ++column) {
        const double left = column - 0.5 * side_ - p[0];
        if (left > 6 * deviation_u || left + 1 < -6 * deviation_u) continue;
        sum += cells_[static_cast<std::size_t>(row * side_ + column)] * weight *
               (share_below((left + 1) / deviation_u) - share_below(left / deviation_u));
      }
    }
    return sum;
  }

 private:
  const MarkerFamily& family_;
  int side_;
  std::vector<double> cells_;
};

}  // namespace

double corner_bound_px(const sim::Scene& scene) {
  const sim::SceneMarker& marker = scene.markers.at(0);
  const TruthMarker truth = sim::truth(scene).at(0);
  const Pattern pattern(marker.id);
  const sim::Sensor& sensor = scene.sensor;
  // The lens' blur and the pixel's square.
  const double blur = std::sqrt(sensor.blur_sigma_px * sensor.blur_sigma_px + 1 / 12.0);
  const Vec3 normal = {marker.pose.R[2], marker.pose.R[5], marker.pose.R[8]};
  const Vec3 light = normalized(scene.lighting.direction);
  const double facing = std::fabs(dot(normal, light));
  const double contrast = (sensor.white_level - sensor.black_level) * (marker.white - marker.black) *
                          (scene.lighting.ambient + scene.lighting.direct * facing);
  constexpr double kStep = 1e-3;
  std::vector<Homography> maps;
  maps.emplace_back(scene.camera, truth.corners, pattern.border());
  for (std::size_t k = 0; k < kCorners; ++k) {
    Quad moved = truth.corners;
    moved[k / 2][k % 2] += kStep;
    maps.emplace_back(scene.camera, moved, pattern.border());
  }

  double information[kUnknowns][kUnknowns] = {};
  const double variance = sensor.read_noise * sensor.read_noise + 1 / 12.0;
  for (int y = 0; y < scene.camera.height; ++y) {
    for (int x = 0; x < scene.camera.width; ++x) {
      const std::array<double, 2> at = maps[0](x, y);
      if (std::fabs(at[0]) > pattern.half() || std::fabs(at[1]) > pattern.half()) continue;
      const std::array<double, 2> right = maps[0](x + kStep, y), below = maps[0](x, y + kStep);
      const double du = blur / kStep * std::hypot(right[0] - at[0], below[0] - at[0]);
      const double dv = blur / kStep * std::hypot(right[1] - at[1], below[1] - at[1]);
      const double level = pattern.at(at, du, dv);
      double row[kUnknowns];
      for (std::size_t k = 0; k < kCorners; ++k) {
        row[k] = contrast * (pattern.at(maps[k + 1](x, y), du, dv) - level) / kStep;
      }
      row[8] = contrast * (pattern.at(at, du * (1 + kStep), dv * (1 + kStep)) - level) / kStep;
      const double tones[3] = {1, at[0] / pattern.half(), at[1] / pattern.half()};
      for (std::size_t k = 0; k < 3; ++k) {
        row[9 + k] = tones[k];
        row[12 + k] = tones[k] * level;
      }
      for (std::size_t i = 0; i < kUnknowns; ++i) {
        for (std::size_t j = 0; j < kUnknowns; ++j) information[i][j] += row[i] * row[j] / variance;
      }
    }
  }
  // Trace of the corners' part of the inverse, by Gauss-Jordan.
  double inverse[kUnknowns][kUnknowns] = {};
  for (std::size_t i = 0; i < kUnknowns; ++i) inverse[i][i] = 1;
  for (std::size_t k = 0; k < kUnknowns; ++k) {
    const double pivot = information[k][k];
    for (std::size_t c = 0; c < kUnknowns; ++c) {
      information[k][c] /= pivot;
      inverse[k][c] /= pivot;
    }
    for (std::size_t r = 0; r < kUnknowns; ++r) {
      if (r == k) continue;
      const double factor = information[r][k];
      for (std::size_t c = 0; c < kUnknowns; ++c) {
        information[r][c] -= factor * information[k][c];
        inverse[r][c] -= factor * inverse[k][c];
      }
    }
  }
  double trace = 0;
  for (std::size_t k = 0; k < kCorners; ++k) trace += inverse[k][k];
  return std::sqrt(trace / 4);
}

}  // namespace berth::bench
