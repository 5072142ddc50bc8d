#pragma once

#include <array>

#include "pose_algebra.hpp"
#include "target/refine_pose.hpp"
#include "target/symmetric.hpp"

namespace berth {

/// Pose and velocity with their covariance, at some time. Errors are (translation, turn, velocity, turning speed), m,
/// rad, m/s, rad/s, axes parallel to the camera's: the true pose is moved(pose, error).
struct Motion {
  Pose pose;
  std::array<double, 6> velocity = {};
  /// 12 × 12 in blocks of 6 × 6: pose, pose with velocity (rows pose), velocity.
  SquareMatrix<6> pose_covariance = {};
  SquareMatrix<6> cross_covariance = {};
  SquareMatrix<6> velocity_covariance = {};
};

/// Goes on for `seconds` at constant velocity, whose random walk adds `variance` (of the six velocities, in one second)
/// to it (white acceleration: Bar-Shalom, Li and Kirubarajan, "Estimation with Applications to Tracking and
/// Navigation", 2001, 6.2.2).
void advance(double seconds, const std::array<double, 6>& variance, Motion& motion);

/// The motion once its pose is known as well as `refined` says, which had this motion's pose as its prior. Velocities
/// follow by their covariance with the pose. False where that is not positive definite.
bool absorb(const RefinedPose& refined, Motion& motion);

}  // namespace berth
