#pragma once

#include "navset/parts.hpp"
#include "navset/target.hpp"

namespace berth::navset {

// What a camera may see that is not the target. Models are about as large as the target (radius 0.1 to 0.3 m).

/// One of eight kinds of spacecraft, never two alike.
Model other_satellite(sim::Random& random);
/// Boxes, drums, lamps, tools, chairs: what stands about.
Model clutter(sim::Random& random);
/// An arm, a rover or a free flyer.
Model robot(sim::Random& random);
/// A simple body in the target's colours and sheets.
Model decoy(const Livery& livery, sim::Random& random);
/// A strut, a plate or a cable such as may hang before the camera.
Model obstacle(sim::Random& random);

}  // namespace berth::navset
