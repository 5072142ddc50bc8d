#pragma once

#include <vector>

#include "berth/marker.hpp"

namespace berth {

/// The printed marker, one byte a module (0 dark, 255 light), row-major [total_width, total_width], upright: the border
/// with its light ring, and the data bits. Modules that carry neither (the corners of round families) are dark.
/// Throws Error on an id the family does not have.
std::vector<u8> marker_pattern(const MarkerFamily& family, int id);

}  // namespace berth
