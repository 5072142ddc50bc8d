#pragma once

#include <cstdint>
#include <string>

#include "berth/station_pairing.hpp"
#include "pose_algebra.hpp"
#include "ros2/messages.hpp"

namespace berth::cli {

/// What the vehicles' frames are called, with any prefix. By REP-105 the robot's is its base_link.
struct VehicleFrames {
  std::string robot, dock;
};

/// Of the moment's time, which both stations' frames are of.
inline const char* clock_of(const StationMoment& moment) { return moment.frames[moment.came[0] ? 0 : 1].stamp.clock; }

/// Whether there is a pose to drive by: one on which the stations disagree is none.
inline bool is_agreed(const FusedPose& fused) { return fused.has_pose && !fused.disagree; }

// A fused pose as ROS 2 messages, which borrow the names.

/// The robot in the dock's frame, whose axes are the covariance's.
inline ros2::PoseWithCovarianceStamped robot_message(std::int64_t stamp_ns, const VehicleFrames& frames,
                                                     const RelativePose& robot) {
  return {{stamp_ns, frames.dock}, robot.pose, robot.uncertainty.covariance};
}

/// From the robot's frame, which has its parent in the robot's own tree, to the dock's.
inline ros2::TransformList dock_transform(std::int64_t stamp_ns, const VehicleFrames& frames,
                                          const RelativePose& robot) {
  return {{{{stamp_ns, frames.robot}, frames.dock, inverse(robot.pose)}}};
}

}  // namespace berth::cli
