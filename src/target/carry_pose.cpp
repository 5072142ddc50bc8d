#include "target/carry_pose.hpp"

#include "target/symmetric.hpp"

namespace berth {
namespace {

using Mat6 = SquareMatrix<6>;

// (turn, -turn [arm]x; 0, turn), which takes a pose's error on to another's.
Mat6 carrier(const Mat3& turn, const Vec3& arm) {
  const Mat3 by_turn = product(turn, Mat3{0, arm[2], -arm[1], -arm[2], 0, arm[0], arm[1], -arm[0], 0});
  Mat6 m{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      m[i * 6 + j] = m[(i + 3) * 6 + j + 3] = turn[3 * i + j];
      m[i * 6 + j + 3] = by_turn[3 * i + j];
    }
  }
  return m;
}

void carry(const Mat6& by, Mat6& covariance) {
  covariance = multiply<6>(multiply<6>(by, covariance), transposed<6>(by));
}

}  // namespace

// R(w) R t' + t + dt: turning moves what is away from the inner origin.
RefinedPose compose(RefinedPose outer, const Pose& inner) {
  carry(carrier({1, 0, 0, 0, 1, 0, 0, 0, 1}, product(outer.pose.R, inner.t)), outer.covariance);
  outer.pose = berth::compose(outer.pose, inner);
  return outer;
}
RefinedPose compose(const Pose& outer, RefinedPose inner) {
  carry(carrier(outer.R, {0, 0, 0}), inner.covariance);
  inner.pose = berth::compose(outer, inner.pose);
  return inner;
}
// The error of the inverse is -Rᵀ (dt + [t]x w) and -Rᵀ w; the sign is nothing to a covariance.
RefinedPose inverse(RefinedPose pose) {
  carry(carrier(transposed(pose.pose.R), scaled(pose.pose.t, -1)), pose.covariance);
  pose.pose = berth::inverse(pose.pose);
  return pose;
}

}  // namespace berth
