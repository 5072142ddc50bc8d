#pragma once

#include <array>
#include <cmath>

#include "berth/marker.hpp"
#include "sim/geometry.hpp"
#include "sim/random.hpp"

namespace berth::test {

/// Closing in from 1.5 to 0.3 m in 1,000 frames, never more than 10 degrees from facing the camera.
class Approach {
 public:
  explicit Approach(u64 seed) : random_(seed) {
    for (double& value : at_) value = random_.uniform(0, 6.28);
    for (double& value : turns_) value = random_.uniform(3, 18);
  }
  static constexpr int kFrames = 1000;
  Pose pose(int frame) const {
    const double u = static_cast<double>(frame) / (kFrames - 1), z = 1.5 * std::pow(0.2, u);
    constexpr double kTilt = 0.12;
    return {
        sim::rotation(kTilt * std::sin(turns_[0] * u + at_[0]), kTilt * std::sin(turns_[1] * u + at_[1]), at_[2] + u),
        {0.1 * z * std::sin(4 * u + at_[0]), 0.08 * z * std::sin(5 * u + at_[1]), z}};
  }

 private:
  sim::Random random_;
  std::array<double, 3> at_ = {};
  std::array<double, 2> turns_ = {};
};

}  // namespace berth::test
