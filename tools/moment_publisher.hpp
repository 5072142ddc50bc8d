#pragma once

#include <memory>

#include "moment_messages.hpp"
#include "moment_observer.hpp"
#include "ros_options.hpp"

namespace berth::cli {

/// Publishes the pose of two stations to ROS 2 nodes (docs/ros2.md). The moments' thread copies one into a free slot
/// and goes on; one thread makes messages of it and sends them. `gate`: of FusedPose::disagree. Throws Error where the
/// network cannot be had, or this build has no ROS 2 output.
std::unique_ptr<MomentObserver> make_moment_publisher(const RosPlan& plan, const VehicleFrames& frames, double gate);

}  // namespace berth::cli
