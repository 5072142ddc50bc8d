#pragma once

#include "target/fit_scene.hpp"
#include "target/marker_map.hpp"

namespace berth {

/// Dark and contrast as planes through the grey levels in the modules' middles, which is near enough to start from.
/// Returns false and changes nothing where too few modules are neither black nor white to tell.
bool first_levels(const FitScene& scene, const MarkerMap& map, FitState& state);

}  // namespace berth
