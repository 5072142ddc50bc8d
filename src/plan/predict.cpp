#include "plan/predict.hpp"

#include <algorithm>
#include <cmath>
#include <vector>

#include "pose_algebra.hpp"
#include "target/marker_pose.hpp"
#include "target/refine_pose.hpp"

namespace berth::plan {
namespace {

using Corners = std::array<Vec2, 4>;

// Rendered markers of all blurs and tilts (docs/plan.md): times the blur where that is above a pixel.
constexpr double kModule_px = 1.4;

Vec2 unit_between(const Vec2& from, const Vec2& to) {
  const Vec2 way = {to[0] - from[0], to[1] - from[1]};
  const double length = std::sqrt(way[0] * way[0] + way[1] * way[1]);
  return {way[0] / length, way[1] / length};
}

/// Moves corner `i`, where `side` ends at it, as the side's line moves across itself by `offset`: along the other side.
void move_side(const Corners& corners, std::size_t side, std::size_t i, double offset, Corners& moved) {
  const Vec2 own = unit_between(corners[side], corners[(side + 1) % 4]);
  const std::size_t other = i == side ? (side + 3) % 4 : (side + 1) % 4;
  const Vec2 along = unit_between(corners[other], corners[(other + 1) % 4]);
  const double across = own[0] * along[1] - own[1] * along[0];
  for (std::size_t k = 0; k < 2; ++k) moved[i][k] += offset / across * along[k];
}

/// The corners, each time off in one way by one standard deviation.
std::vector<Corners> errors_of(const Corners& corners, const CornerNoise& noise) {
  std::vector<Corners> all;
  for (std::size_t side = 0; side < 4; ++side) {
    const double shift = noise.side_end_px[side] * std::sqrt(noise.shift_share[side]);
    const double turn = noise.side_end_px[side] * std::sqrt(1 - noise.shift_share[side]);
    for (const auto& [first, second] : {std::pair(shift, shift), std::pair(-turn, turn)}) {
      Corners moved = corners;
      move_side(corners, side, side, first, moved);
      move_side(corners, side, (side + 1) % 4, second, moved);
      all.push_back(moved);
    }
  }
  return all;
}

}  // namespace

bool predict(const View& view, Prediction& prediction) {
  // Seen from its front, the marker's z axis points away.
  if (!(view.pose.t[2] > view.size_m) || !(dot(column(view.pose.R, 2), view.pose.t) > 0)) return false;
  Prediction result;
  result.corners = corner_noise(view);
  const Corners corners = true_corners(view);
  const std::vector<Corners> errors = errors_of(corners, result.corners);
  // Corners weigh what such errors leave of them, as a detection's do.
  CornerCovariance covariance{};
  for (const Corners& seen : errors) {
    for (std::size_t i = 0; i < 64; ++i) {
      const std::size_t a = i / 8, b = i % 8;
      covariance[i] += (seen[a / 2][a % 2] - corners[a / 2][a % 2]) * (seen[b / 2][b % 2] - corners[b / 2][b % 2]);
    }
  }
  for (const Corners& seen : errors) {
    const SeenCorners points = seen_corners_of(view.size_m, seen, covariance);
    RefinedPose refined;
    if (!refine_pose(view.camera, &points, 1, view.pose, refined)) return false;
    const table::SixAxes error = table::pose_error(refined.pose, view.pose);
    for (std::size_t i = 0; i < 6; ++i) {
      for (std::size_t j = 0; j < 6; ++j) result.covariance[i * 6 + j] += error[i] * error[j];
    }
  }
  for (std::size_t i = 0; i < 6; ++i) result.deviation[i] = std::sqrt(result.covariance[i * 7]);
  result.position_m = length({result.deviation[0], result.deviation[1], result.deviation[2]});
  prediction = result;
  return true;
}

bool readable(const View& view, const MarkerFamily& family) {
  const CornerNoise noise = corner_noise(view);
  return noise.shortest_px / family.border_width >= kModule_px * std::max(1.0, noise.blur_px);
}

bool fits(const View& view, const MarkerFamily& family) {
  View whole = view;
  whole.size_m *= (std::max(family.total_width, family.border_width) + 2.0) / family.border_width;
  for (const Vec2& corner : true_corners(whole)) {
    if (corner[0] < -0.5 || corner[0] > view.camera.width - 0.5) return false;
    if (corner[1] < -0.5 || corner[1] > view.camera.height - 0.5) return false;
  }
  return true;
}

double decode_range_m(View view, const MarkerFamily& family) {
  const Vec3 way = normalized(view.pose.t);
  const auto readable_at = [&](double range_m) {
    view.pose.t = scaled(way, range_m);
    return readable(view, family);
  };
  double near = 3 * view.size_m;
  double far = near;
  if (!readable_at(near)) return 0;
  while (readable_at(far)) far *= 2;
  for (int k = 0; k < 40; ++k) {
    const double middle = (near + far) / 2;
    (readable_at(middle) ? near : far) = middle;
  }
  return near;
}

}  // namespace berth::plan
