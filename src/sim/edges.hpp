#pragma once

#include <vector>

#include "berth/types.hpp"
#include "sim/layer.hpp"
#include "sim/lens.hpp"

namespace berth::sim {

/// Marks the pixels that an edge of the layer runs through: its outline, and the sides of its cells where the albedo
/// changes. flags u64[height, width], where `bit` is set. A pixel left unmarked shows one smooth patch of one surface.
void mark_edges(const Layer& layer, const RayMap& rays, u64 bit, std::vector<u64>& flags);

}  // namespace berth::sim
