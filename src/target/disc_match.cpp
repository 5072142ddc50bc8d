#include "target/disc_match.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "pose_algebra.hpp"
#include "target/marker_pose.hpp"
#include "target/planar_pose.hpp"
#include "target/sample.hpp"

namespace berth {
namespace {

// Two discs of a plate are seen under nearly one affine map: by how much their distance may be off it, as a share, and
// the areas of the two maps differ. Perspective makes that much of a target as wide as its distance.
constexpr double kDistance = 0.3, kArea = 2.5;
// Of a disc, how far off that map it may lie, as a share of the distance to its neighbour; and its size, in diameters.
constexpr double kPlace = 0.35, kSize = 1.6;
// At the pose: of a centre, px and a share of the ellipse's longer half axis; of the half axes, shares, and px.
constexpr double kCenter_px = 0.5, kCenterShare = 0.02, kAxis = 0.12, kAxis_px = 0.4;
// Pairs that are followed up, and points along a bar.
constexpr int kMostPairs = 4000, kBarPoints = 5, kBarDark = 4;
// Of the discs' mean contrast, by how much one may be lighter than they are on the mean.
constexpr double kDark = 0.25;
// A bar is looked at inside of these shares of its length.
constexpr double kBarFirst = 0.2, kBarLast = 0.8;

/// A symmetric matrix as Ellipse has it.
using Sym = std::array<double, 3>;

double determinant(const Sym& m) { return m[0] * m[2] - m[1] * m[1]; }

/// The positive root of a positive matrix.
Sym root_of(const Sym& m) {
  const double s = std::sqrt(determinant(m)), t = std::sqrt(m[0] + m[2] + 2 * s);
  return {(m[0] + s) / t, m[1] / t, (m[2] + s) / t};
}

Vec2 times(const Sym& m, const Vec2& v) { return {m[0] * v[0] + m[1] * v[1], m[1] * v[0] + m[2] * v[1]}; }
Sym inverse_of(const Sym& m) {
  const double det = determinant(m);
  return {m[2] / det, -m[1] / det, m[0] / det};
}
Vec2 less(const Vec2& a, const Vec2& b) { return {a[0] - b[0], a[1] - b[1]}; }
double square(const Vec2& v) { return v[0] * v[0] + v[1] * v[1]; }
Vec2 place(const TargetDisc& disc) { return {disc.x_m, disc.y_m}; }

/// The seen ellipse by the disc's size: the affine map's square, J Jᵀ, from metres of the plate to the camera's plane.
Sym map_square(const FittedDisc& seen, const TargetDisc& disc) {
  const double by = 4 / (disc.diameter_m * disc.diameter_m);
  return {seen.in_plane.matrix[0] * by, seen.in_plane.matrix[1] * by, seen.in_plane.matrix[2] * by};
}

/// Whether the ellipse that was seen has the axes of the one expected.
bool same_shape(const FittedDisc& seen, const Ellipse& expected) {
  // Expected in px: L M Lᵀ.
  const auto& l = seen.lens;
  const Sym& m = expected.matrix;
  const Vec2 a = times(m, {l[0], l[1]}), b = times(m, {l[2], l[3]});
  const Ellipse in_px{{}, {l[0] * a[0] + l[1] * a[1], l[2] * a[0] + l[3] * a[1], l[2] * b[0] + l[3] * b[1]}};
  const std::array<double, 2> axes = in_px.axes_squared();
  for (std::size_t k = 0; k < 2; ++k) {
    const double should = std::sqrt(std::max(0.0, axes[k])), is = std::sqrt(seen.axes_px2[k]);
    if (!(std::fabs(should - is) <= kAxis * should + kAxis_px)) return false;
  }
  return true;
}

/// Least squares of an affine map from the plate's places, about their middle, to where they were seen.
bool affine_of(const Vec3* places, const Vec2* seen, std::size_t count, Vec2& origin, std::array<double, 4>& map) {
  Sym spread = {0, 0, 0};
  std::array<Vec2, 2> across = {Vec2{0, 0}, Vec2{0, 0}};
  origin = {0, 0};
  for (std::size_t i = 0; i < count; ++i) {
    const double x = places[i][0], y = places[i][1];
    spread = {spread[0] + x * x, spread[1] + x * y, spread[2] + y * y};
    for (std::size_t k = 0; k < 2; ++k) {
      origin[k] += seen[i][k] / static_cast<double>(count);
      across[k] = {across[k][0] + x * seen[i][k], across[k][1] + y * seen[i][k]};
    }
  }
  if (!(determinant(spread) > 1e-6 * spread[0] * spread[2])) return false;
  const Sym back = inverse_of(spread);
  const Vec2 u = times(back, across[0]), v = times(back, across[1]);
  map = {u[0], u[1], v[0], v[1]};
  return true;
}

}  // namespace

DiscMatcher::DiscMatcher(const DiscTarget& target) : target_(target) {
  target_.check();
  for (std::size_t i = 0; i < target_.discs.size(); ++i) {
    for (std::size_t j = 0; j < target_.discs.size(); ++j) {
      const double apart = square(less(place(target_.discs[i]), place(target_.discs[j])));
      squares_m2_[i][j] = apart;
      if (i != j && (nearest_m2_[i] == 0 || apart < nearest_m2_[i])) nearest_m2_[i] = apart;
    }
  }
}

void DiscMatcher::find(const CameraModel& camera, View2D<const u8> image, const FittedDisc* discs, std::size_t count,
                       DiscPose& result) {
  result = {};
  seen_ = discs;
  count_ = std::min(count, kMostSeen);
  tried_count_ = 0;
  pairs_ = 0;
  const std::size_t parts = target_.discs.size();
  Solution best;
  DiscChoice choice;
  // Any two of the frame's discs as any two of the target's.
  for (std::size_t i = 0; i < count_; ++i) {
    for (std::size_t j = i + 1; j < count_; ++j) {
      for (std::size_t k = 0; k < parts; ++k) {
        for (std::size_t l = 0; l < parts; ++l) {
          DiscAssignment assignment{};
          if (k == l || !may_be(k, i) || !may_be(l, j) || pairs_ >= kMostPairs) continue;
          if (!assign_from(i, j, k, l, assignment) || is_known(assignment)) continue;
          Solution solution;
          if (!attempt(camera, image, assignment, solution)) continue;
          if (choice.offer(solution.assignment, solution.used, solution.pose.chi_square)) best = solution;
        }
      }
      if (best.used == static_cast<int>(parts)) i = j = count_;
    }
  }
  if (choice.empty() || choice.is_doubtful()) return;
  result.has_pose = true;
  result.pose = best.pose.pose;
  result.uncertainty = uncertainty_of(best.pose, best.has_other ? &best.other : nullptr);
  result.used = best.used;
  for (std::size_t k = 0; k < parts; ++k) {
    if (best.assignment[k] == kNoDisc) continue;
    const FittedDisc& seen = seen_[best.assignment[k]];
    result.discs[k] = {true, seen.center_px, seen.covariance_px2};
  }
}

bool DiscMatcher::may_be(std::size_t disc, std::size_t seen) const {
  return (target_.discs[disc].hole_m > 0) == seen_[seen].is_ring;
}

// The affine map of two discs that are taken for k and l, by their shapes and their distance, and what else lies where
// it puts the others. False where the two do not agree, or too few others do.
bool DiscMatcher::assign_from(std::size_t i, std::size_t j, std::size_t k, std::size_t l, DiscAssignment& assignment) {
  const Sym first = map_square(seen_[i], target_.discs[k]), second = map_square(seen_[j], target_.discs[l]);
  const double ratio = determinant(first) / determinant(second);
  if (!(ratio < kArea && ratio * kArea > 1)) return false;
  const Sym both = {(first[0] + second[0]) / 2, (first[1] + second[1]) / 2, (first[2] + second[2]) / 2};
  const Sym root = root_of(both), back = inverse_of(root);
  const Vec2 &from = seen_[i].in_plane.center, &to = seen_[j].in_plane.center;
  const Vec2 straight = times(back, less(to, from));  // the plate's vector, turned
  const double length = std::sqrt(square(straight) / squares_m2_[k][l]);
  if (!(std::fabs(length - 1) < kDistance)) return false;
  ++pairs_;
  const Vec2 wanted = less(place(target_.discs[l]), place(target_.discs[k]));
  const double c = (wanted[0] * straight[0] + wanted[1] * straight[1]) / (length * squares_m2_[k][l]);
  const double s = (wanted[0] * straight[1] - wanted[1] * straight[0]) / (length * squares_m2_[k][l]);
  assignment.fill(kNoDisc);
  std::array<bool, kMostSeen> taken{};
  assignment[k] = static_cast<int>(i);
  assignment[l] = static_cast<int>(j);
  taken[i] = taken[j] = true;
  std::size_t matched = 2;
  for (std::size_t m = 0; m < target_.discs.size(); ++m) {
    if (m == k || m == l) continue;
    // From the middle of the two, where the map is both's.
    const Vec2 off = less(place(target_.discs[m]), {(target_.discs[k].x_m + target_.discs[l].x_m) / 2,
                                                    (target_.discs[k].y_m + target_.discs[l].y_m) / 2});
    const Vec2 moved = times(root, {c * off[0] - s * off[1], s * off[0] + c * off[1]});
    const Vec2 expected = {(from[0] + to[0]) / 2 + moved[0], (from[1] + to[1]) / 2 + moved[1]};
    double least = kPlace * kPlace * nearest_m2_[m];
    for (std::size_t n = 0; n < count_; ++n) {
      if (taken[n] || !may_be(m, n)) continue;
      const double off_m2 = square(times(back, less(seen_[n].in_plane.center, expected)));
      if (!(off_m2 < least)) continue;
      const double area = determinant(map_square(seen_[n], target_.discs[m])) / determinant(both);
      const double most = kSize * kSize * kSize * kSize;
      if (!(area < most && area * most > 1)) continue;
      least = off_m2;
      assignment[m] = static_cast<int>(n);
    }
    if (assignment[m] == kNoDisc) continue;
    taken[static_cast<std::size_t>(assignment[m])] = true;
    ++matched;
  }
  return matched >= DiscTarget::kFewestDiscs;
}

// Pairs of one target lead to the same assignment again and again.
bool DiscMatcher::is_known(const DiscAssignment& assignment) {
  const auto end = tried_.begin() + static_cast<std::ptrdiff_t>(tried_count_);
  if (std::find(tried_.begin(), end, assignment) != end) return true;
  if (tried_count_ == DiscChoice::kMost) return true;  // a frame full of discs: what has been tried must do
  tried_[tried_count_++] = assignment;
  return false;
}

std::size_t DiscMatcher::gather(const DiscAssignment& assignment,
                                std::array<SeenDisc, DiscTarget::kMostDiscs>& discs) const {
  std::size_t count = 0;
  for (std::size_t k = 0; k < target_.discs.size(); ++k) {
    if (assignment[k] != kNoDisc) discs[count++] = {target_.discs[k], seen_[assignment[k]]};
  }
  return count;
}

// Both poses of the plane, refined, the one that fits better first.
bool DiscMatcher::solve(const DiscAssignment& assignment, RefinedPose& best, RefinedPose& other,
                        bool& has_other) const {
  std::array<SeenDisc, DiscTarget::kMostDiscs> discs;
  const std::size_t count = gather(assignment, discs);
  if (count < DiscTarget::kFewestDiscs) return false;
  Vec3 middle = {0, 0, 0};
  std::array<Vec3, DiscTarget::kMostDiscs> places{};
  std::array<Vec2, DiscTarget::kMostDiscs> seen{};
  for (std::size_t i = 0; i < count; ++i) {
    places[i] = {discs[i].disc.x_m, discs[i].disc.y_m, 0};
    seen[i] = discs[i].fitted.in_plane.center;
    middle = add(middle, scaled(places[i], 1 / static_cast<double>(count)));
  }
  for (std::size_t i = 0; i < count; ++i) places[i] = add(places[i], scaled(middle, -1));
  Vec2 origin{};
  std::array<double, 4> map{};
  std::array<Pose, 2> starts;
  if (!affine_of(places.data(), seen.data(), count, origin, map) || !(map[0] * map[3] - map[1] * map[2] > 0)) {
    return false;
  }
  const int found = planar_poses(origin, map, places.data(), seen.data(), count, starts);
  std::array<RefinedPose, 2> refined;
  std::size_t good = 0;
  for (int k = 0; k < found; ++k) {
    Pose start = starts[static_cast<std::size_t>(k)];
    start.t = add(start.t, scaled(product(start.R, middle), -1));
    if (refine_disc_pose(discs.data(), count, target_.deviation_m, start, refined[good]) &&
        faces_camera(refined[good].pose)) {
      ++good;
    }
  }
  if (good == 0) return false;
  if (good == 2 && refined[1].chi_square < refined[0].chi_square) std::swap(refined[0], refined[1]);
  best = refined[0];
  other = refined[1];
  has_other = good == 2 && !same_pose(refined[0], refined[1]);
  return true;
}

// For each disc of the target the nearest of the frame's that has the place, the size and the shape that it has at the
// pose. False where that one is a ring and should be a disc, or the other way round: the target is turned otherwise.
bool DiscMatcher::assign_at(const Pose& pose, DiscAssignment& assignment) const {
  assignment.fill(kNoDisc);
  for (std::size_t k = 0; k < target_.discs.size(); ++k) {
    Ellipse expected;
    if (!disc_ellipse(pose, target_.discs[k], expected)) continue;
    double least = 0;
    for (std::size_t n = 0; n < count_; ++n) {
      const double off_px = center_error_px(seen_[n], expected);
      const double limit = kCenter_px + kCenterShare * std::sqrt(seen_[n].axes_px2[1]);
      if (!(off_px <= limit) || !same_shape(seen_[n], expected)) continue;
      if (assignment[k] != kNoDisc && !(off_px < least)) continue;
      assignment[k] = static_cast<int>(n);
      least = off_px;
    }
    if (assignment[k] != kNoDisc && !may_be(k, static_cast<std::size_t>(assignment[k]))) return false;
  }
  return true;
}

// The discs' mean levels; false where one is far from as dark as they are on the mean: a ring under so much blur that
// it passes for a disc, or nothing of the kind.
bool DiscMatcher::mean_levels(const Solution& solution, Levels& levels) const {
  for (std::size_t k = 0; k < target_.discs.size(); ++k) {
    if (solution.assignment[k] == kNoDisc) continue;
    levels.dark += seen_[solution.assignment[k]].dark / solution.used;
    levels.light += seen_[solution.assignment[k]].light / solution.used;
  }
  const double most = levels.dark + kDark * (levels.light - levels.dark);
  for (std::size_t k = 0; k < target_.discs.size(); ++k) {
    if (solution.assignment[k] != kNoDisc && !(seen_[solution.assignment[k]].dark < most)) return false;
  }
  return true;
}

// Every bar must be dark along its middle, by the levels of the discs, and those must agree.
bool DiscMatcher::looks_right(const CameraModel& camera, View2D<const u8> image, const Solution& solution) const {
  Levels levels;
  if (!mean_levels(solution, levels)) return false;
  for (const TargetBar& bar : target_.bars) {
    int darks = 0;
    for (int i = 0; i < kBarPoints; ++i) {
      const double s = kBarFirst + (kBarLast - kBarFirst) * i / (kBarPoints - 1);
      const Vec3 at = transform(solution.pose.pose, {bar.from_m[0] + s * (bar.to_m[0] - bar.from_m[0]),
                                                     bar.from_m[1] + s * (bar.to_m[1] - bar.from_m[1]), 0});
      if (!(at[2] > 0)) return false;
      const Vec2 px = image_of(camera, at);
      double level = 0;
      if (sample(image, px[0], px[1], level) && level < (levels.dark + levels.light) / 2) ++darks;
    }
    if (darks < kBarDark) return false;
  }
  return true;
}

// A pose from an assignment, settled with what else lies where the pose puts the discs. False where too little does.
bool DiscMatcher::attempt(const CameraModel& camera, View2D<const u8> image, const DiscAssignment& start,
                          Solution& solution) const {
  constexpr int kRounds = 3;
  DiscAssignment assignment = start;
  RefinedPose& pose = solution.pose;
  bool settled = false;
  for (int round = 0; round < kRounds && !settled; ++round) {
    if (!solve(assignment, pose, solution.other, solution.has_other)) return false;
    DiscAssignment now{};
    if (!assign_at(pose.pose, now)) return false;
    settled = now == assignment;
    assignment = now;
  }
  if (!settled) return false;
  solution.assignment = assignment;
  solution.used = 0;
  for (std::size_t k = 0; k < target_.discs.size(); ++k) solution.used += assignment[k] == kNoDisc ? 0 : 1;
  const bool enough = solution.used >= static_cast<int>(DiscTarget::kFewestDiscs) &&
                      2 * solution.used > static_cast<int>(target_.discs.size());
  return enough && looks_right(camera, image, solution);
}

}  // namespace berth
