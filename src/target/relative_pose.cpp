#include <cmath>
#include <utility>

#include "berth/stations.hpp"
#include "target/carry_pose.hpp"
#include "target/marker_pose.hpp"
#include "target/pose_steps.hpp"

namespace berth {
namespace {

// Optima nearer to each other than this are one, m and rad: steps end far below it.
constexpr double kSame = 1e-5;

// One station's solutions for the robot's pose, the better first.
struct Solutions {
  std::array<RefinedPose, 2> of_robot;
  std::size_t count = 0;
};

// Robot frame to dock frame, from marker frame to camera frame.
RefinedPose by_robot(const Station& station, const RefinedPose& view) {
  return compose(station.marker, compose(inverse(view), inverse(station.camera)));
}
RefinedPose by_dock(const Station& station, const RefinedPose& view) {
  return compose(station.camera, compose(view, inverse(station.marker)));
}

SeenCorners corners_of(const Station& station, const Detection& marker) {
  return seen_corners_of(station.marker_size_m, marker.corners, corner_covariance(marker, station.corner_deviation_px));
}

template <class ToRobot>
Solutions solutions(const Station& station, const Detection* marker, ToRobot to_robot) {
  Solutions found;
  if (marker == nullptr || !marker->has_pose || !marker->pose_uncertainty) return found;
  const SeenCorners corners = corners_of(station, *marker);
  const auto add = [&](const Pose& start) {
    RefinedPose view;
    if (!refine_pose(station.lens, &corners, 1, start, view)) return;
    found.of_robot[found.count++] = to_robot(station, view);
  };
  add(marker->pose);
  if (marker->pose_uncertainty->has_other) add(marker->pose_uncertainty->other);
  if (found.count == 2 && found.of_robot[1].chi_square < found.of_robot[0].chi_square) {
    std::swap(found.of_robot[0], found.of_robot[1]);
  }
  return found;
}

// All corners of both images, with the robot's pose unknown.
class BothViews {
 public:
  BothViews(const StationPair& stations, const Detection& robot, const Detection& dock)
      : robot_(stations.robot),
        dock_(stations.dock),
        to_robot_(inverse(stations.robot.camera)),
        to_dock_(inverse(stations.dock.camera)),
        seen_by_robot_(corners_of(robot_, robot)),
        seen_by_dock_(corners_of(dock_, dock)) {}

  bool operator()(const Pose& pose, PoseNormal& normal) const {
    std::array<Vec3, 4> arms;
    // A point of the robot is at R b + t in the dock's frame.
    for (std::size_t i = 0; i < 4; ++i) {
      arms[i] = product(pose.R, transform(dock_.marker, seen_by_dock_.points_m[i]));
    }
    if (!add_seen(
            dock_.lens, seen_by_dock_, normal, [&](std::size_t i) { return transform(to_dock_, add(arms[i], pose.t)); },
            [&](std::size_t i, const Vec3& by_point) {
              return step_row(product(transposed(to_dock_.R), by_point), arms[i]);
            })) {
      return false;
    }
    // A point c of the dock is at Rᵀ (c - t) in the robot's frame, which a step moves by -Rᵀ (dt + w x (c - t)).
    for (std::size_t i = 0; i < 4; ++i) {
      arms[i] = add(transform(robot_.marker, seen_by_robot_.points_m[i]), scaled(pose.t, -1));
    }
    return add_seen(
        robot_.lens, seen_by_robot_, normal,
        [&](std::size_t i) { return transform(to_robot_, product(transposed(pose.R), arms[i])); },
        [&](std::size_t i, const Vec3& by_point) {
          return step_row(scaled(product(pose.R, product(transposed(to_robot_.R), by_point)), -1), arms[i]);
        });
  }

 private:
  const Station &robot_, &dock_;
  Pose to_robot_, to_dock_;  // vehicle to camera
  SeenCorners seen_by_robot_, seen_by_dock_;
};

double apart(const Pose& a, const Pose& b) {
  double most = 0;
  for (const double value : step_between(a, b)) most = std::fmax(most, std::fabs(value));
  return most;
}

// The first two different ones, by their sums of squares.
void offer(const RefinedPose& pose, Solutions& best) {
  for (std::size_t k = 0; k < best.count; ++k) {
    if (apart(pose.pose, best.of_robot[k].pose) < kSame) return;
  }
  if (best.count < 2) {
    best.of_robot[best.count++] = pose;
  } else if (pose.chi_square < best.of_robot[1].chi_square) {
    best.of_robot[1] = pose;
  }
  if (best.count == 2 && best.of_robot[1].chi_square < best.of_robot[0].chi_square) {
    std::swap(best.of_robot[0], best.of_robot[1]);
  }
}

RelativePose result_of(const Solutions& best, int views) {
  RelativePose result;
  result.views = views;
  result.pose = best.of_robot[0].pose;
  result.uncertainty = uncertainty_of(best.of_robot[0], best.count > 1 ? &best.of_robot[1] : nullptr);
  return result;
}

const RefinedPose& nearest(const Solutions& solutions, const Pose& pose) {
  const bool second =
      solutions.count > 1 && apart(solutions.of_robot[1].pose, pose) < apart(solutions.of_robot[0].pose, pose);
  return solutions.of_robot[second ? 1 : 0];
}

}  // namespace

bool relative_pose(const StationPair& stations, const Detection* robot, const Detection* dock, RelativePose& result) {
  const Solutions from_robot = solutions(stations.robot, robot, by_robot);
  const Solutions from_dock = solutions(stations.dock, dock, by_dock);
  if (from_robot.count == 0 && from_dock.count == 0) return false;
  if (from_robot.count == 0 || from_dock.count == 0) {
    result = result_of(from_dock.count == 0 ? from_robot : from_dock, 1);
    return true;
  }
  const BothViews both(stations, *robot, *dock);
  Solutions best;
  for (const Solutions* starts : {&from_robot, &from_dock}) {
    for (std::size_t k = 0; k < starts->count; ++k) {
      RefinedPose pose;
      double squares_px = 0;
      if (!least_squares_pose(starts->of_robot[k].pose, both, pose, squares_px)) continue;
      pose.error_px = std::sqrt(squares_px / 8);
      offer(pose, best);
    }
  }
  if (best.count == 0) return false;
  result = result_of(best, 2);
  const RefinedPose &robot_alone = nearest(from_robot, result.pose), &dock_alone = nearest(from_dock, result.pose);
  result.disagreement = best.of_robot[0].chi_square - robot_alone.chi_square - dock_alone.chi_square;
  result.difference = step_between(robot_alone.pose, dock_alone.pose);
  return true;
}

}  // namespace berth
