#pragma once

#include <vector>

#include "berth/marker.hpp"
#include "sim/random.hpp"
#include "sim/scene.hpp"

namespace berth::sim {

/// Adds a wall across the view, with `items` things on it: boards, racks, cables, lettering, checkers, discs. `wall` is
/// its plane frame; the items spread over `width_m` × `height_m` around its origin.
void add_wall(std::vector<Surface>& surfaces, const Pose& wall, double width_m, double height_m, int items,
              Random& random);

/// A code at least `distance` bits from every code word of the family in every rotation, but not much more than that
/// from one: what a misread marker looks like. Distance 5 is beyond what a decoder that mends 3 bits may accept.
u64 near_code(const MarkerFamily& family, int distance, Random& random);

/// Smallest number of bits in which the code differs from a code word of the family, in any rotation.
int distance_to_family(const MarkerFamily& family, u64 code);

/// Adds something that a hasty detector takes for a marker of the family, side about `size_m`, at the plane frame: a
/// near-tag (kind 0), a chequered square (1), nested squares (2), an empty dark square (3) or window panes (4).
void add_decoy(std::vector<Surface>& surfaces, const Pose& plane, const MarkerFamily& family, double size_m, int kind,
               Random& random);
constexpr int kDecoyKinds = 5;

}  // namespace berth::sim
