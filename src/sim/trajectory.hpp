#pragma once

#include <memory>

#include "sim/geometry.hpp"
#include "sim/scene.hpp"

namespace berth::sim {

class TomlReader;

/// Where the target body is in the camera frame, as a smooth function of the journey: s = 0 at the middle of the first
/// exposure, 1 at the middle of the last, a little beyond on either side during those exposures.
class Trajectory {
 public:
  virtual ~Trajectory() = default;
  virtual Pose body(double s, double time_s) const = 0;
};

/// Reads [trajectory] of so many frames: kind "approach", "rectangle", "axis" or "views" with their keys
/// (docs/simulator.md).
std::unique_ptr<Trajectory> read_trajectory(TomlReader& reader, int frames);

/// The motion between two instants of one exposure, for Scene::motion.
Motion motion_between(const Pose& before, const Pose& after);

}  // namespace berth::sim
