#include "table/corner_bound.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "sim/lens.hpp"
#include "sim/printed_marker.hpp"
#include "sim/render.hpp"
#include "target/symmetric.hpp"

namespace berth::table {
namespace {

constexpr std::size_t kCorners = 8, kBlur = 8, kTones = 9, kUnknowns = 15;
using Quad = std::array<std::array<double, 2>, 4>;

// Rays to marker coordinates in modules from the pattern's middle, corners in the paper's order.
class Homography {
 public:
  Homography(const CameraModel& camera, const Quad& corners_px, double side) {
    // Eight equations u = (a x + b y + c) / (g x + h y + 1) by elimination.
    double m[8][9] = {};
    for (int i = 0; i < 4; ++i) {
      const std::size_t k = static_cast<std::size_t>(i);
      const Vec2 ray = camera.undistort(corners_px[k][0], corners_px[k][1]);
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
  Vec2 operator()(const Vec2& ray) const {
    const double z = h_[6] * ray[0] + h_[7] * ray[1] + 1;
    return {(h_[0] * ray[0] + h_[1] * ray[1] + h_[2]) / z, (h_[3] * ray[0] + h_[4] * ray[1] + h_[5]) / z};
  }

 private:
  double h_[8] = {};
};

double share_below(double t) { return 0.5 * std::erfc(-t / std::sqrt(2.0)); }
double bell(double t) { return std::exp(-0.5 * t * t) / std::sqrt(2 * sim::kPi); }

// How much of a blurred point lies in each module along one axis, and how that changes.
struct Shares {
  int first = 0;
  std::vector<double> share, by_place, by_blur;

  void set(double place, double deviation, int side) {
    const double low = 0.5 * side + place - 6 * deviation, high = 0.5 * side + place + 6 * deviation;
    first = std::max(0, static_cast<int>(std::floor(low)));
    const int last = std::min(side - 1, static_cast<int>(std::floor(high)));
    share.clear();
    by_place.clear();
    by_blur.clear();
    for (int i = first; i <= last; ++i) {
      const double a = (i - 0.5 * side - place) / deviation, b = a + 1 / deviation;
      share.push_back(share_below(b) - share_below(a));
      by_place.push_back((bell(a) - bell(b)) / deviation);
      by_blur.push_back(a * bell(a) - b * bell(b));  // per relative change of the deviation
    }
  }
};

// Of the printed pattern, blurred: 0 dark, 1 light; by place along u and v (modules), and by the blur's relative size.
struct Level {
  double value = 0, by_u = 0, by_v = 0, by_blur = 0;
};

class Pattern {
 public:
  Pattern(const MarkerFamily& family, int id)
      : side_(family.total_width + 2),
        cells_(sim::pattern_cells(family, family.codes.at(static_cast<std::size_t>(id)), 1, 0)) {}

  Level at(const Vec2& place, double deviation_u, double deviation_v) {
    across_.set(place[0], deviation_u, side_);
    down_.set(place[1], deviation_v, side_);
    Level level;
    for (std::size_t r = 0; r < down_.share.size(); ++r) {
      for (std::size_t c = 0; c < across_.share.size(); ++c) {
        const int row = down_.first + static_cast<int>(r), column = across_.first + static_cast<int>(c);
        if (cells_[static_cast<std::size_t>(row * side_ + column)] == 0) continue;
        level.value += down_.share[r] * across_.share[c];
        level.by_u += down_.share[r] * across_.by_place[c];
        level.by_v += down_.by_place[r] * across_.share[c];
        level.by_blur += down_.share[r] * across_.by_blur[c] + down_.by_blur[r] * across_.share[c];
      }
    }
    return level;
  }

 private:
  int side_;
  std::vector<double> cells_;
  Shares across_, down_;
};

// Grey levels of the marker's dark and light above the sensor's black, and the variance of a pixel between.
class Greys {
 public:
  explicit Greys(const sim::Scene& scene) : sensor_(scene.sensor) {
    const sim::SceneMarker& marker = scene.markers.at(0);
    const double facing = std::fabs(dot(column(marker.pose.R, 2), normalized(scene.lighting.direction)));
    const double light = scene.lighting.ambient + scene.lighting.direct * facing;
    dark_ = (sensor_.white_level - sensor_.black_level) * light * marker.black;
    contrast_ = (sensor_.white_level - sensor_.black_level) * light * (marker.white - marker.black);
  }
  double contrast(const Vec2& ray) const { return fall_off(ray) * contrast_; }
  double variance(const Vec2& ray, double level) const {
    const double shot = sensor_.full_well_e > 0 ? 255 / sensor_.full_well_e : 0;
    return sensor_.read_noise * sensor_.read_noise + 1 / 12.0 + shot * fall_off(ray) * (dark_ + level * contrast_);
  }

 private:
  double fall_off(const Vec2& ray) const {
    const double cos2 = 1 / (1 + ray[0] * ray[0] + ray[1] * ray[1]);
    return 1 + sensor_.vignetting * (cos2 * cos2 - 1);
  }
  const sim::Sensor& sensor_;
  double dark_ = 0, contrast_ = 0;
};

using Row = std::array<double, kUnknowns>;

// Pixels that may show the marker with its light ring.
struct Window {
  int left, top, right, bottom;
  Window(const CameraModel& camera, const Quad& corners) {
    std::array<double, 2> low = corners[0], high = corners[0];
    for (const auto& corner : corners) {
      for (std::size_t k = 0; k < 2; ++k) {
        low[k] = std::min(low[k], corner[k]);
        high[k] = std::max(high[k], corner[k]);
      }
    }
    const double margin = 0.5 * std::max(high[0] - low[0], high[1] - low[1]);
    left = std::max(0, static_cast<int>(low[0] - margin));
    top = std::max(0, static_cast<int>(low[1] - margin));
    right = std::min(camera.width, static_cast<int>(high[0] + margin) + 1);
    bottom = std::min(camera.height, static_cast<int>(high[1] + margin) + 1);
  }
};

}  // namespace

CornerInformation corner_information(const sim::Scene& scene) {
  const sim::SceneMarker& marker = scene.markers.at(0);
  const CameraModel& camera = scene.camera;
  const Quad corners = sim::truth(scene).at(0).corners;
  const MarkerFamily& shape = family(marker.family);
  Pattern pattern(shape, marker.id);
  const double half = shape.total_width / 2.0;  // with the light ring
  const Greys greys(scene);
  const sim::Sensor& sensor = scene.sensor;
  // The lens' blur and the pixel's square.
  const double blur = std::sqrt(sensor.blur_sigma_px * sensor.blur_sigma_px + 1 / 12.0);
  constexpr double kStep_px = 1e-3;
  const Homography map(camera, corners, shape.border_width);
  std::vector<Homography> moved;
  for (std::size_t k = 0; k < kCorners; ++k) {
    Quad other = corners;
    other[k / 2][k % 2] += kStep_px;
    moved.emplace_back(camera, other, shape.border_width);
  }

  const Window window(camera, corners);
  SquareMatrix<kUnknowns> information{};
  for (int y = window.top; y < window.bottom; ++y) {
    for (int x = window.left; x < window.right; ++x) {
      const Vec2 ray = camera.undistort(x, y);
      const Vec2 at = map(ray);
      if (!(std::fabs(at[0]) <= half && std::fabs(at[1]) <= half)) continue;
      const Vec2 right = map(camera.undistort(x + kStep_px, y)), below = map(camera.undistort(x, y + kStep_px));
      const double du = blur / kStep_px * std::hypot(right[0] - at[0], below[0] - at[0]);
      const double dv = blur / kStep_px * std::hypot(right[1] - at[1], below[1] - at[1]);
      const Level level = pattern.at(at, du, dv);
      const double contrast = greys.contrast(ray);
      Row row;
      for (std::size_t k = 0; k < kCorners; ++k) {
        const Vec2 there = moved[k](ray);
        row[k] = contrast / kStep_px * (level.by_u * (there[0] - at[0]) + level.by_v * (there[1] - at[1]));
      }
      row[kBlur] = contrast * level.by_blur;
      const double tones[3] = {1, at[0] / half, at[1] / half};
      for (std::size_t k = 0; k < 3; ++k) {
        row[kTones + k] = tones[k];
        row[kTones + 3 + k] = tones[k] * level.value;
      }
      const double variance = greys.variance(ray, level.value);
      for (std::size_t i = 0; i < kUnknowns; ++i) {
        for (std::size_t j = 0; j < kUnknowns; ++j) information[i * kUnknowns + j] += row[i] * row[j] / variance;
      }
    }
  }
  // What is left of the corners' own when the others have to be found as well: the inverse of the inverse's part.
  SquareMatrix<kUnknowns> covariance{};
  CornerInformation result{};
  if (!invert<kUnknowns>(information, covariance)) return result;
  SquareMatrix<kCorners> of_corners{};
  for (std::size_t i = 0; i < kCorners; ++i) {
    for (std::size_t j = 0; j < kCorners; ++j) of_corners[i * kCorners + j] = covariance[i * kUnknowns + j];
  }
  if (!invert<kCorners>(of_corners, result)) result = {};
  return result;
}

std::optional<double> corner_bound_px(const CornerInformation& information) {
  SquareMatrix<kCorners> covariance{};
  if (!invert<kCorners>(information, covariance)) return std::nullopt;
  double trace = 0;
  for (std::size_t k = 0; k < kCorners; ++k) trace += covariance[k * kCorners + k];
  return std::sqrt(trace / 4);
}

std::optional<SixAxes> pose_bound(const CameraModel& camera, const TruthMarker& marker,
                                  const CornerInformation& information) {
  // Central differences: a step of 1e-6 of the range, or rad.
  constexpr double kStep = 1e-6;
  const double range_m = length(marker.pose.t);
  const auto seen = [&](std::size_t axis, double step) {
    Pose pose = marker.pose;
    if (axis < 3) {
      pose.t[axis] += step * range_m;
    } else {
      Vec3 turn = {0, 0, 0};
      turn[axis - 3] = step;
      pose.R = product(sim::rotation(turn[0], turn[1], turn[2]), pose.R);
    }
    std::array<double, 8> corners;
    const std::array<Vec3, 4> places = sim::marker_corners(marker.size_m);
    for (std::size_t i = 0; i < 4; ++i) {
      const Vec3 point = transform(pose, places[i]);
      const Vec2 pixel = sim::image_point(camera, {point[0] / point[2], point[1] / point[2]});
      corners[2 * i] = pixel[0];
      corners[2 * i + 1] = pixel[1];
    }
    return corners;
  };
  std::array<std::array<double, 8>, 6> by_axis;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    const std::array<double, 8> after = seen(axis, kStep), before = seen(axis, -kStep);
    const double step = 2 * kStep * (axis < 3 ? range_m : 1);
    for (std::size_t k = 0; k < 8; ++k) by_axis[axis][k] = (after[k] - before[k]) / step;
  }
  SquareMatrix<6> of_pose{}, covariance{};
  for (std::size_t i = 0; i < 6; ++i) {
    const std::array<double, 8> weighted = multiply<8>(information, by_axis[i]);
    for (std::size_t j = 0; j < 6; ++j) {
      for (std::size_t k = 0; k < 8; ++k) of_pose[6 * i + j] += weighted[k] * by_axis[j][k];
    }
  }
  if (!invert<6>(of_pose, covariance)) return std::nullopt;
  SixAxes bound;
  for (std::size_t i = 0; i < 6; ++i) bound[i] = std::sqrt(covariance[7 * i]);
  return bound;
}

}  // namespace berth::table
