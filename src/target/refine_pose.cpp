#include "target/refine_pose.hpp"

#include <algorithm>
#include <cmath>

#include "pose_algebra.hpp"
#include "target/symmetric.hpp"

namespace berth {
namespace {

constexpr std::size_t kUnknowns = 6;
using Vec6 = std::array<double, kUnknowns>;
using Mat6 = SquareMatrix<kUnknowns>;

// Steps end when one promises to lower the sum of squares (standard deviations) by less than the first share of it.
// Where a plane's two poses have become one, least squares are as flat as a fourth power and come nearer ever more
// slowly: what promises less than the second share there is within the noise.
constexpr int kMostSteps = 30;
constexpr double kLeastGain = 1e-9, kEnough = 1e-3;
constexpr double kNearest_m = 1e-6;
// Relative to the diagonal. Below the least it is as good as none, and would only take longer to rise again.
constexpr double kFirstDamping = 1e-4, kLeastDamping = 1e-7;

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

// The distance from what was expected. Turns compose as Gibbs vectors, h' = (a + h + a x h) / (1 - a.h), a and h halves
// of the turns: from a = 0 the derivative is 1 - [h]x + h hT.
void add_prior(const Pose& pose, const PosePrior& prior, Normal& normal) {
  const Vec6 off = step_between(prior.pose, pose);
  const double x = off[3] / 2, y = off[4] / 2, z = off[5] / 2;
  const Mat6 by_step = {1, 0, 0, 0,         0,         0,          //
                        0, 1, 0, 0,         0,         0,          //
                        0, 0, 1, 0,         0,         0,          //
                        0, 0, 0, 1 + x * x, x * y + z, x * z - y,  //
                        0, 0, 0, x * y - z, 1 + y * y, y * z + x,  //
                        0, 0, 0, x * z + y, y * z - x, 1 + z * z};
  const Mat6 weighted = multiply<kUnknowns>(transposed<kUnknowns>(by_step), prior.information);
  const Mat6 matrix = multiply<kUnknowns>(weighted, by_step);
  const Vec6 gradient = multiply<kUnknowns>(weighted, off);
  for (std::size_t i = 0; i < kUnknowns; ++i) normal.gradient[i] -= gradient[i];
  for (std::size_t i = 0; i < kUnknowns * kUnknowns; ++i) normal.matrix[i] += matrix[i];
  normal.squares += quadratic<kUnknowns>(prior.information, off);
}

bool linearise(const CameraModel& camera, const PoseCorner* corners, std::size_t count, const PosePrior* prior,
               const Pose& pose, Normal& normal) {
  normal = {};
  for (std::size_t i = 0; i < count; ++i) {
    if (!add_corner(camera, pose, corners[i], normal)) return false;
  }
  if (prior != nullptr) add_prior(pose, *prior, normal);
  return normal.squares - normal.squares == 0;
}

}  // namespace

bool refine_pose(const CameraModel& camera, const PoseCorner* corners, std::size_t count, const Pose& start,
                 RefinedPose& result, const PosePrior* prior) {
  if (count < 3) return false;
  Normal here;
  Pose pose = start;
  if (!linearise(camera, corners, count, prior, pose, here)) return false;
  double damping = kFirstDamping;
  double gain = 1;  // relative, that the last step promised
  for (int k = 0; k < kMostSteps && gain > kLeastGain; ++k) {
    Mat6 damped = here.matrix;
    for (std::size_t i = 0; i < kUnknowns; ++i) damped[i * kUnknowns + i] *= 1 + damping;
    if (!factorise<kUnknowns>(damped)) return false;
    const Vec6 step = solve<kUnknowns>(damped, here.gradient);
    double promised = 0;
    for (std::size_t i = 0; i < kUnknowns; ++i) promised += step[i] * here.gradient[i];
    const Pose next = moved(pose, step);
    Normal there;
    if (linearise(camera, corners, count, prior, next, there) && there.squares <= here.squares) {
      pose = next;
      here = there;
      damping = std::max(kLeastDamping, damping * 0.1);
    } else {
      damping *= 10;
    }
    gain = promised / (1 + here.squares);
  }
  if (!(gain < kEnough)) return false;
  for (std::size_t i = 0; i < kUnknowns; ++i) {  // only the lower half is complete
    for (std::size_t j = i + 1; j < kUnknowns; ++j) here.matrix[i * kUnknowns + j] = here.matrix[j * kUnknowns + i];
  }
  if (!invert<kUnknowns>(here.matrix, result.covariance)) return false;
  result.pose = pose;
  result.chi_square = here.squares;
  result.error_px = std::sqrt(here.squares_px / static_cast<double>(count));
  return true;
}

}  // namespace berth
