#pragma once

#include <vector>

#include "sim/scene.hpp"

namespace berth::sim {

class TomlReader;

/// The plate, the discs and the bars, far to near.
std::vector<Surface> target_surfaces(const SceneTarget& scene);

/// Reads one [[disc_target]] (docs/simulator.md).
SceneTarget read_scene_target(TomlReader& reader);

}  // namespace berth::sim
