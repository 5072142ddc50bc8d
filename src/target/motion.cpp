#include "target/motion.hpp"

namespace berth {
namespace {

constexpr std::size_t kN = 6;
using Mat6 = SquareMatrix<kN>;

Mat6 sum(const Mat6& a, const Mat6& b) {
  Mat6 c;
  for (std::size_t i = 0; i < c.size(); ++i) c[i] = a[i] + b[i];
  return c;
}

Mat6 times(const Mat6& a, double factor) {
  Mat6 c;
  for (std::size_t i = 0; i < c.size(); ++i) c[i] = a[i] * factor;
  return c;
}

void make_symmetric(Mat6& a) {
  for (std::size_t i = 0; i < kN; ++i) {
    for (std::size_t j = 0; j < i; ++j) a[i * kN + j] = a[j * kN + i] = (a[i * kN + j] + a[j * kN + i]) / 2;
  }
}

}  // namespace

void advance(double seconds, const std::array<double, 6>& variance, Motion& motion) {
  std::array<double, 6> step{};
  for (std::size_t i = 0; i < kN; ++i) step[i] = motion.velocity[i] * seconds;
  const Mat3 turn = small_rotation({step[3], step[4], step[5]});
  motion.pose = moved(motion.pose, step);
  // error of pose' = A (error of pose + seconds · error of velocity), A the turn for the three angles.
  Mat6 a{};
  for (std::size_t i = 0; i < 3; ++i) {
    a[i * kN + i] = 1;
    for (std::size_t j = 0; j < 3; ++j) a[(i + 3) * kN + j + 3] = turn[i * 3 + j];
  }
  const Mat6& p = motion.pose_covariance;
  const Mat6& c = motion.cross_covariance;
  const Mat6& v = motion.velocity_covariance;
  const Mat6 cross = sum(c, times(v, seconds));
  const Mat6 grown = sum(sum(p, times(sum(c, transposed<kN>(c)), seconds)), times(v, seconds * seconds));
  motion.pose_covariance = multiply<kN>(multiply<kN>(a, grown), transposed<kN>(a));
  motion.cross_covariance = multiply<kN>(a, cross);
  for (std::size_t i = 0; i < kN; ++i) {
    const double q = variance[i] * seconds;
    motion.pose_covariance[i * kN + i] += q * seconds * seconds / 3;
    motion.cross_covariance[i * kN + i] += q * seconds / 2;
    motion.velocity_covariance[i * kN + i] += q;
  }
  make_symmetric(motion.pose_covariance);
}

bool absorb(const RefinedPose& refined, Motion& motion) {
  Mat6 information{};
  if (!invert<kN>(motion.pose_covariance, information)) return false;
  // Given the pose, velocities are v + G (pose - foretold), and what is not known of them beyond it stays as it was.
  const Mat6 gain = multiply<kN>(transposed<kN>(motion.cross_covariance), information);
  const std::array<double, 6> correction = multiply<kN>(gain, step_between(motion.pose, refined.pose));
  const Mat6 cross = multiply<kN>(refined.covariance, transposed<kN>(gain));
  const Mat6 less = multiply<kN>(gain, sum(motion.pose_covariance, times(refined.covariance, -1)));
  const Mat6 lost = multiply<kN>(less, transposed<kN>(gain));
  for (std::size_t i = 0; i < kN; ++i) motion.velocity[i] += correction[i];
  motion.pose = refined.pose;
  motion.pose_covariance = refined.covariance;
  motion.cross_covariance = cross;
  motion.velocity_covariance = sum(motion.velocity_covariance, times(lost, -1));
  make_symmetric(motion.velocity_covariance);
  return true;
}

}  // namespace berth
