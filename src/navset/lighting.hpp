#pragma once

#include "navset/render.hpp"
#include "sim/random.hpp"

namespace berth::navset {

/// Light of one of three moods, `sun`, `earthshine` or `lamps`: in space mostly the first two, indoors mostly the last.
/// The key light is mostly on the camera's side.
Light random_light(bool in_space, sim::Random& random, const char*& mood);

}  // namespace berth::navset
