#include "sim/layer.hpp"

#include <algorithm>
#include <cassert>

#include "sim/random.hpp"

namespace berth::sim {
namespace {

constexpr int kGrainSide = 64;

// The nodes of the grain repeat every 64 wavelengths: far more than any surface has.
const std::array<double, kGrainSide * kGrainSide>& grain_nodes() {
  static const std::array<double, kGrainSide* kGrainSide> nodes = [] {
    std::array<double, kGrainSide * kGrainSide> values{};
    for (std::size_t i = 0; i < values.size(); ++i) values[i] = 2 * unit(scatter(0x6772u + i)) - 1;
    return values;
  }();
  return nodes;
}

Vec2 ray_of(const Vec3& point) { return {point[0] / point[2], point[1] / point[2]}; }

}  // namespace

namespace {

double one_octave(double x, double y) {
  const auto& nodes = grain_nodes();
  const long long column = floor_int(x), row = floor_int(y);
  const double fx = x - static_cast<double>(column), fy = y - static_cast<double>(row);
  const double sx = fx * fx * (3 - 2 * fx), sy = fy * fy * (3 - 2 * fy);
  const auto node = [&](long long c, long long r) {
    return nodes[static_cast<std::size_t>((r & (kGrainSide - 1)) * kGrainSide + (c & (kGrainSide - 1)))];
  };
  const double top = node(column, row) + sx * (node(column + 1, row) - node(column, row));
  const double bottom = node(column, row + 1) + sx * (node(column + 1, row + 1) - node(column, row + 1));
  return top + sy * (bottom - top);
}

}  // namespace

double grain(double x, double y) {
  // The second octave is turned by atan(3/4), so that the grids of nodes do not show.
  return 0.65 * one_octave(x, y) + 0.35 * one_octave(1.6 * x - 1.2 * y + 7.3, 1.2 * x + 1.6 * y + 2.9);
}

std::vector<Vec3> cut_near(const std::vector<Vec3>& polygon) {
  std::vector<Vec3> result;
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const Vec3& a = polygon[i];
    const Vec3& b = polygon[(i + 1) % polygon.size()];
    if (a[2] >= kNear_m) result.push_back(a);
    if ((a[2] >= kNear_m) != (b[2] >= kNear_m)) {
      const double s = (kNear_m - a[2]) / (b[2] - a[2]);
      result.push_back({a[0] + s * (b[0] - a[0]), a[1] + s * (b[1] - a[1]), kNear_m});
    }
  }
  return result;
}

Layer::Layer(const Surface& surface, const Pose& pose, const Vec3& to_light) : surface_(&surface), pose_(pose) {
  const Vec3 normal = scaled(column(pose.R, 2), -1);
  facing_ = std::max(0.0, dot(normal, to_light));
  if (!(dot(normal, pose.t) < 0)) return;  // seen from behind or edge on

  const Mat3 to_plane =
      inverse(Mat3{pose.R[0], pose.R[1], pose.t[0], pose.R[3], pose.R[4], pose.t[1], pose.R[6], pose.R[7], pose.t[2]});
  to_x_ = {to_plane[0], to_plane[1], to_plane[2]};
  to_y_ = {to_plane[3], to_plane[4], to_plane[5]};
  to_w_ = {to_plane[6], to_plane[7], to_plane[8]};

  std::vector<Vec2> outline = surface.outline;
  if (disc()) {
    // A polygon around the circle, for the bounds only.
    outline.clear();
    for (int i = 0; i < 8; ++i) {
      const double angle = kPi / 4 * i, radius = surface.outer_radius * 1.0824;  // 1 / cos(pi / 8)
      outline.push_back({radius * exact_cos(angle), radius * exact_sin(angle)});
    }
  }
  assert(outline.size() >= 3 && outline.size() <= kMaxOutline);
  std::vector<Vec3> points;
  for (const Vec2& corner : outline) points.push_back(camera_point(corner));
  const std::vector<Vec3> seen = cut_near(points);
  if (seen.size() < 3) return;
  visible_ = true;
  low_ = high_ = ray_of(seen[0]);
  for (const Vec3& point : seen) {
    const Vec2 ray = ray_of(point);
    for (std::size_t i = 0; i < 2; ++i) {
      low_[i] = std::min(low_[i], ray[i]);
      high_[i] = std::max(high_[i], ray[i]);
    }
  }

  if (!disc()) {
    for (std::size_t i = 0; i < outline.size(); ++i) {
      const Vec2& a = outline[i];
      const Vec2& b = outline[(i + 1) % outline.size()];
      const double nx = a[1] - b[1], ny = b[0] - a[0];
      const double offset = nx * a[0] + ny * a[1];
      side_[static_cast<std::size_t>(sides_++)] =
          add(add(scaled(to_x_, nx), scaled(to_y_, ny)), scaled(to_w_, -offset));
    }
  }
  const bool all_in_front = seen.size() == points.size();
  if (!all_in_front || disc()) side_[static_cast<std::size_t>(sides_++)] = to_w_;
}

Vec3 Layer::camera_point(const Vec2& plane) const { return transform(pose_, Vec3{plane[0], plane[1], 0}); }

bool Layer::hit(const Vec2& ray) const {
  for (int i = 0; i < sides_; ++i) {
    const Vec3& line = side_[static_cast<std::size_t>(i)];
    if (line[0] * ray[0] + line[1] * ray[1] + line[2] < 0) return false;
  }
  if (!disc()) return true;
  const Vec2 point = plane_point(ray);
  const double r2 = point[0] * point[0] + point[1] * point[1];
  return r2 <= surface_->outer_radius * surface_->outer_radius && r2 >= surface_->inner_radius * surface_->inner_radius;
}

Seen Layer::look(const Vec2& ray) const {
  const Surface& s = *surface_;
  double albedo = s.cells[0];
  const bool plain = s.cells.size() == 1 && s.grain == 0 && s.slope[0] == 0 && s.slope[1] == 0;
  if (!plain) {
    const Vec2 point = plane_point(ray);
    if (s.cells.size() > 1) {
      const auto clamped = [](double cell, int count) {
        return cell < 0 ? 0 : cell >= count ? count - 1 : static_cast<int>(cell);
      };
      const int c = clamped((point[0] - s.left) / s.cell_width, s.columns);
      const int r = clamped((point[1] - s.top) / s.cell_height, s.rows);
      albedo = s.cells[static_cast<std::size_t>(r) * static_cast<std::size_t>(s.columns) + static_cast<std::size_t>(c)];
    }
    albedo *= std::max(0.0, 1 + s.slope[0] * point[0] + s.slope[1] * point[1]);
    if (s.grain != 0) albedo *= 1 + s.grain * grain(point[0] / s.grain_m, point[1] / s.grain_m);
  }
  return {albedo, facing_};
}

}  // namespace berth::sim
