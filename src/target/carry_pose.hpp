#pragma once

#include "pose_algebra.hpp"
#include "target/refine_pose.hpp"

/// Poses with their covariances, seen from other frames that are known exactly.
namespace berth {

/// As compose(outer.pose, inner): the outer frame's pose of what is at `inner`.
RefinedPose compose(RefinedPose outer, const Pose& inner);
/// As compose(outer, inner.pose).
RefinedPose compose(const Pose& outer, RefinedPose inner);
RefinedPose inverse(RefinedPose pose);

}  // namespace berth
