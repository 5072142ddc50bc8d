#include "target/refine_pose.hpp"

#include <algorithm>
#include <cmath>

#include "pose_algebra.hpp"

namespace berth {
namespace {

constexpr std::size_t kUnknowns = 6;
using Vec6 = std::array<double, kUnknowns>;
using Mat6 = std::array<double, kUnknowns * kUnknowns>;

constexpr int kMostSteps = 20;
// A step that promises to lower the sum of squares (standard deviations) by less than this share changes nothing that
// could be measured.
constexpr double kLeastGain = 1e-12;
constexpr double kNearest_m = 1e-6;
// Relative to the diagonal. Below the least it is as good as none, and would only take longer to rise again.
constexpr double kFirstDamping = 1e-4, kLeastDamping = 1e-7;

// Lower triangle L of a = L Lᵀ in place; false where a is not positive definite.
bool factorise(Mat6& a) {
  for (std::size_t j = 0; j < kUnknowns; ++j) {
    double d = a[j * kUnknowns + j];
    const double whole = d;
    for (std::size_t k = 0; k < j; ++k) d -= a[j * kUnknowns + k] * a[j * kUnknowns + k];
    if (!(d > 1e-14 * whole)) return false;
    const double root = std::sqrt(d);
    a[j * kUnknowns + j] = root;
    for (std::size_t i = j + 1; i < kUnknowns; ++i) {
      double v = a[i * kUnknowns + j];
      for (std::size_t k = 0; k < j; ++k) v -= a[i * kUnknowns + k] * a[j * kUnknowns + k];
      a[i * kUnknowns + j] = v / root;
    }
  }
  return true;
}

Vec6 solve(const Mat6& factor, Vec6 b) {
  for (std::size_t i = 0; i < kUnknowns; ++i) {
    for (std::size_t k = 0; k < i; ++k) b[i] -= factor[i * kUnknowns + k] * b[k];
    b[i] /= factor[i * kUnknowns + i];
  }
  for (std::size_t i = kUnknowns; i-- > 0;) {
    for (std::size_t k = i + 1; k < kUnknowns; ++k) b[i] -= factor[k * kUnknowns + i] * b[k];
    b[i] /= factor[i * kUnknowns + i];
  }
  return b;
}

// Normal equations of all corners at one pose, in units of standard deviations.
struct Normal {
  Mat6 matrix = {};
  Vec6 gradient = {};  // minus half the sum of squares' derivative
  double squares = 0;
  double squares_px = 0;
};

// Adds a row of weight 1.
void add_row(const Vec6& row, double residual, Normal& normal) {
  for (std::size_t i = 0; i < kUnknowns; ++i) {
    normal.gradient[i] += row[i] * residual;
    for (std::size_t j = 0; j <= i; ++j) normal.matrix[i * kUnknowns + j] += row[i] * row[j];
  }
  normal.squares += residual * residual;
}

// The two image rows of a corner, derivatives by translation, then rotation about the camera's axes.
bool add_corner(const CameraModel& camera, const Pose& pose, const PoseCorner& corner, Normal& normal) {
  const Vec3 arm = product(pose.R, corner.point_m);
  const Vec3 at = add(arm, pose.t);
  if (!(at[2] > kNearest_m)) return false;
  const double x = at[0] / at[2], y = at[1] / at[2];
  std::array<double, 4> lens{};
  const Vec2 image = camera.project(x, y, lens);
  std::array<Vec6, 2> rows{};
  for (std::size_t k = 0; k < 2; ++k) {
    const double dx = lens[2 * k] / at[2], dy = lens[2 * k + 1] / at[2];
    const Vec3 by_point = {dx, dy, -(dx * x + dy * y)};
    const Vec3 by_turn = cross(arm, by_point);  // by_point · (w × arm)
    rows[k] = {by_point[0], by_point[1], by_point[2], by_turn[0], by_turn[1], by_turn[2]};
  }
  const Vec2 off = {corner.seen_px[0] - image[0], corner.seen_px[1] - image[1]};
  normal.squares_px += off[0] * off[0] + off[1] * off[1];
  // Whitened by the inverse of the covariance's factor: (1/a, 0; -b/(a c), 1/c) of (a, 0; b, c).
  const std::array<double, 3>& cov = corner.covariance_px2;
  const double a = std::sqrt(cov[0]), b = cov[1] / a;
  const double rest = cov[2] - b * b;
  if (!(a > 0) || !(rest > 0)) return false;
  const double c = std::sqrt(rest);
  Vec6 first{};
  Vec6 second{};
  for (std::size_t i = 0; i < kUnknowns; ++i) {
    first[i] = rows[0][i] / a;
    second[i] = (rows[1][i] - b * first[i]) / c;
  }
  const double e0 = off[0] / a;
  add_row(first, e0, normal);
  add_row(second, (off[1] - b * e0) / c, normal);
  return true;
}

bool linearise(const CameraModel& camera, const PoseCorner* corners, std::size_t count, const Pose& pose,
               Normal& normal) {
  normal = {};
  for (std::size_t i = 0; i < count; ++i) {
    if (!add_corner(camera, pose, corners[i], normal)) return false;
  }
  return normal.squares - normal.squares == 0;
}

Pose moved(const Pose& pose, const Vec6& step) {
  Pose result;
  result.R = product(small_rotation({step[3], step[4], step[5]}), pose.R);
  result.t = {pose.t[0] + step[0], pose.t[1] + step[1], pose.t[2] + step[2]};
  return result;
}

}  // namespace

bool refine_pose(const CameraModel& camera, const PoseCorner* corners, std::size_t count, const Pose& start,
                 RefinedPose& result) {
  if (count < 3) return false;
  Normal here;
  Pose pose = start;
  if (!linearise(camera, corners, count, pose, here)) return false;
  double damping = kFirstDamping;
  bool settled = false;
  for (int k = 0; k < kMostSteps && !settled; ++k) {
    Mat6 damped = here.matrix;
    for (std::size_t i = 0; i < kUnknowns; ++i) damped[i * kUnknowns + i] *= 1 + damping;
    if (!factorise(damped)) return false;
    const Vec6 step = solve(damped, here.gradient);
    double promised = 0;
    for (std::size_t i = 0; i < kUnknowns; ++i) promised += step[i] * here.gradient[i];
    const Pose next = moved(pose, step);
    Normal there;
    if (linearise(camera, corners, count, next, there) && there.squares <= here.squares) {
      pose = next;
      here = there;
      damping = std::max(kLeastDamping, damping * 0.1);
    } else {
      damping *= 10;
    }
    settled = !(promised > kLeastGain * (1 + here.squares));
  }
  if (!settled) return false;
  Mat6 factor = here.matrix;
  if (!factorise(factor)) return false;
  for (std::size_t j = 0; j < kUnknowns; ++j) {
    Vec6 unit{};
    unit[j] = 1;
    const Vec6 column = solve(factor, unit);
    for (std::size_t i = j; i < kUnknowns; ++i) {
      result.covariance[i * kUnknowns + j] = result.covariance[j * kUnknowns + i] = column[i];
    }
  }
  result.pose = pose;
  result.chi_square = here.squares;
  result.error_px = std::sqrt(here.squares_px / static_cast<double>(count));
  return true;
}

}  // namespace berth
