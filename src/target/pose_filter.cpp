#include "berth/pose_filter.hpp"

#include <algorithm>
#include <cmath>
#include <cstddef>
#include <string>
#include <utility>

#include "berth/error.hpp"
#include "target/marker_pose.hpp"
#include "target/motion.hpp"
#include "target/refine_pose.hpp"

namespace berth {
namespace {

/// Ways to join the planar poses of the frames that are followed at the same time.
constexpr std::size_t kMostWays = 6;
/// From each way: where it foretells the pose, and both planar poses of the frame.
constexpr std::size_t kStarts = 3;
/// Ways nearer than this are one, in squares of standard deviations of pose and of velocity.
constexpr double kSame = 1;
/// A way without a past begins with every frame, at this cost: should all the others be on the wrong one of two poses,
/// it is cheaper than they after some frames.
constexpr double kAnew = 40;
/// Ways that cost more are given up.
constexpr double kMostCost = 60;
/// Poses further apart than this are different ones, in squares of standard deviations: exceeded by one in 70 of those
/// that differ by noise.
constexpr double kOther = 16;
/// A planar pose of the frame nearer to what a way foretells than the first is on the same slope of least squares; one
/// further off than the second is out of its reach.
constexpr double kSameSlope = 1, kReach = 150;

/// One way to join the poses so far.
struct Way {
  Motion motion;
  /// How much worse than the best one it fits, in squares of standard deviations.
  double cost = 0;
  /// Its place among the last frame's; kMostWays if it has no past.
  std::size_t from = 0;
  /// That it was measured in.
  int frames = 1;
};

void check(bool good, const char* name, double value) {
  if (!good) throw Error("pose filter: " + std::string(name) + " is " + std::to_string(value) + "; give more than 0");
}

PoseFilterConfig checked(const PoseFilterConfig& config) {
  const std::pair<const char*, double> positive[] = {{"marker_size_m", config.marker_size_m},
                                                     {"corner_deviation_px", config.corner_deviation_px},
                                                     {"acceleration", config.acceleration},
                                                     {"angular_acceleration", config.angular_acceleration},
                                                     {"first_velocity", config.first_velocity},
                                                     {"first_angular_velocity", config.first_angular_velocity},
                                                     {"gate", config.gate},
                                                     {"most_outliers", config.most_outliers},
                                                     {"lost_s", config.lost_s},
                                                     {"sure", config.sure}};
  for (const auto& [name, value] : positive) check(value > 0, name, value);
  return config;
}

bool same(const Motion& a, const Motion& b) {
  SquareMatrix<6> information{};
  if (!invert<6>(a.pose_covariance, information)) return false;
  if (!(quadratic<6>(information, step_between(a.pose, b.pose)) < kSame)) return false;
  std::array<double, 6> off{};
  for (std::size_t i = 0; i < 6; ++i) off[i] = a.velocity[i] - b.velocity[i];
  return invert<6>(a.velocity_covariance, information) && quadratic<6>(information, off) < kSame;
}

}  // namespace

struct PoseFilter::Impl {
  explicit Impl(const PoseFilterConfig& wanted) : config(checked(wanted)) {
    for (std::size_t i = 0; i < 3; ++i) {
      variance[i] = config.acceleration * config.acceleration;
      variance[i + 3] = config.angular_acceleration * config.angular_acceleration;
    }
  }

  /// Keeps `way` among the best of `found`, cheapest first; of equal ones the earlier.
  void keep(const Way& way) {
    for (std::size_t i = 0; i < found_count; ++i) {
      if (!same(found[i].motion, way.motion)) continue;
      if (found[i].cost <= way.cost) return;
      std::copy(found.begin() + static_cast<std::ptrdiff_t>(i) + 1,
                found.begin() + static_cast<std::ptrdiff_t>(found_count),
                found.begin() + static_cast<std::ptrdiff_t>(i));
      --found_count;
      break;
    }
    std::size_t at = found_count;
    while (at > 0 && found[at - 1].cost > way.cost) --at;
    if (at == kMostWays) return;
    found_count = std::min(found_count + 1, kMostWays);
    for (std::size_t i = found_count - 1; i > at; --i) found[i] = found[i - 1];
    found[at] = way;
  }

  /// The frame's planar poses without any past, each at that cost and what its corners are off.
  void start(const Detection& marker, double cost) {
    const SeenCorners corners = corners_of(marker);
    const Pose* poses[] = {&marker.pose, other_of(marker)};
    for (const Pose* pose : poses) {
      RefinedPose refined;
      if (pose == nullptr || !refine_pose(config.camera, &corners, 1, *pose, refined)) continue;
      Way way;
      way.motion.pose = refined.pose;
      way.motion.pose_covariance = refined.covariance;
      for (std::size_t i = 0; i < 6; ++i) {
        const double deviation = i < 3 ? config.first_velocity : config.first_angular_velocity;
        way.motion.velocity_covariance[i * 7] = deviation * deviation;
      }
      way.cost = cost + refined.chi_square;
      way.from = kMostWays;
      keep(way);
    }
  }

  /// Each way goes on to each pose that the frame's corners and its past allow.
  void go_on(const Detection& marker) {
    const SeenCorners corners = corners_of(marker);
    for (std::size_t k = 0; k < way_count; ++k) {
      PosePrior prior{ways[k].motion.pose, {}};
      if (!invert<6>(ways[k].motion.pose_covariance, prior.information)) continue;
      const std::array<const Pose*, kStarts> starts = {&prior.pose, &marker.pose, other_of(marker)};
      for (const Pose* pose : starts) {
        if (pose == nullptr) continue;
        const double off = quadratic<6>(prior.information, step_between(prior.pose, *pose));
        if (pose != &prior.pose && (off < kSameSlope || off > kReach)) continue;
        RefinedPose refined;
        if (!refine_pose(config.camera, &corners, 1, *pose, refined, &prior) || refined.chi_square > config.gate) {
          continue;
        }
        Way way = ways[k];
        way.from = k;
        ++way.frames;
        way.cost += refined.chi_square;
        if (absorb(refined, way.motion)) keep(way);
      }
    }
  }

  SeenCorners corners_of(const Detection& marker) const {
    return seen_corners_of(config.marker_size_m, marker.corners, corner_covariance(marker, config.corner_deviation_px));
  }

  static const Pose* other_of(const Detection& marker) {
    const auto& uncertainty = marker.pose_uncertainty;
    return uncertainty && uncertainty->has_other ? &uncertainty->other : nullptr;
  }

  /// Makes `found` the ways; false where there are none.
  bool take_found() {
    if (found_count == 0) return false;
    const double least = found[0].cost;
    way_count = 0;
    for (std::size_t i = 0; i < found_count; ++i) {
      if (found[i].cost - least > kMostCost) break;
      ways[way_count] = found[i];
      ways[way_count++].cost -= least;
    }
    return true;
  }

  void begin(const Detection& marker) {
    found_count = 0;
    start(marker, 0);
    if (!take_found()) {
      way_count = 0;
      return;
    }
    went_in(had_track);
  }

  void went_in(bool jumped) {
    result.measured = true;
    result.jumped = jumped;
    result.age_s = 0;
    outliers = 0;
  }

  void measure(const Detection& marker) {
    if (way_count == 0) {
      begin(marker);
      return;
    }
    found_count = 0;
    go_on(marker);
    if (found_count > 0) start(marker, kAnew);
    if (take_found()) {
      went_in(ways[0].from != 0);
      return;
    }
    result.outlier = true;
    if (++outliers > config.most_outliers) begin(marker);
  }

  /// The best has been followed for a while, and no way with another pose fits nearly as well.
  bool is_sure() const {
    if (ways[0].frames < config.sure_frames) return false;
    for (std::size_t k = 1; k < way_count && ways[k].cost < config.sure; ++k) {
      SquareMatrix<6> information{};
      const Motion& rival = ways[k].motion;
      if (!invert<6>(rival.pose_covariance, information) ||
          quadratic<6>(information, step_between(ways[0].motion.pose, rival.pose)) > kOther) {
        return false;
      }
    }
    return true;
  }

  void report() {
    result.has_pose = way_count > 0;
    if (!result.has_pose) return;
    const Motion& motion = ways[0].motion;
    result.sure = is_sure();
    result.pose = motion.pose;
    result.covariance = motion.pose_covariance;
    result.velocity = motion.velocity;
    result.velocity_covariance = motion.velocity_covariance;
  }

  PoseFilterConfig config;
  std::array<double, 6> variance = {};  // that velocities gain in a second
  std::array<Way, kMostWays> ways;      // the best first
  std::size_t way_count = 0;
  std::array<Way, kMostWays> found;  // by the present frame
  std::size_t found_count = 0;
  int outliers = 0;
  int backwards = 0;       // frames in a row whose time is before the track's
  bool had_track = false;  // before the present frame
  FilteredPose result;
};

PoseFilter::PoseFilter(const PoseFilterConfig& config) : impl_(std::make_unique<Impl>(config)) {}
PoseFilter::~PoseFilter() = default;
PoseFilter::PoseFilter(PoseFilter&&) noexcept = default;
PoseFilter& PoseFilter::operator=(PoseFilter&&) noexcept = default;

const FilteredPose& PoseFilter::update(std::int64_t mid_exposure_ns, const Detection* marker) {
  Impl& it = *impl_;
  FilteredPose& result = it.result;
  it.had_track = it.way_count > 0;
  const bool seen = marker != nullptr && marker->has_pose;
  result.measured = result.jumped = result.outlier = false;
  if (it.had_track && mid_exposure_ns < result.time_ns) {
    // Nothing is said of a time that has passed. A clock that was set must not keep out all that follows.
    const double back_s = static_cast<double>(result.time_ns - mid_exposure_ns) * 1e-9;
    if (back_s <= it.config.lost_s && ++it.backwards <= it.config.most_outliers) {
      result.outlier = seen;
      result.has_pose = false;
      return result;
    }
    it.way_count = 0;
  }
  it.backwards = 0;
  if (it.way_count > 0) {
    const double seconds = static_cast<double>(mid_exposure_ns - result.time_ns) * 1e-9;
    result.age_s += seconds;
    if (result.age_s > it.config.lost_s) it.way_count = 0;
    for (std::size_t k = 0; k < it.way_count; ++k) advance(seconds, it.variance, it.ways[k].motion);
  }
  result.time_ns = mid_exposure_ns;
  if (seen) it.measure(*marker);
  it.report();
  return result;
}

FilteredPose PoseFilter::foretell(std::int64_t time_ns) const {
  const Impl& it = *impl_;
  FilteredPose result = it.result;
  result.measured = result.jumped = result.outlier = false;
  const double seconds = static_cast<double>(time_ns - result.time_ns) * 1e-9;
  result.time_ns = time_ns;
  result.age_s += seconds;
  result.has_pose = it.way_count > 0 && seconds >= 0 && result.age_s <= it.config.lost_s;
  if (!result.has_pose) return result;
  Motion motion = it.ways[0].motion;
  advance(seconds, it.variance, motion);
  result.pose = motion.pose;
  result.covariance = motion.pose_covariance;
  result.velocity_covariance = motion.velocity_covariance;
  return result;
}

void PoseFilter::reset() {
  impl_->way_count = 0;
  impl_->backwards = 0;
  impl_->result = {};
}

}  // namespace berth
