#pragma once

#include "berth/disc_target.hpp"
#include "print_page.hpp"

namespace berth::cli {

/// A target of discs in the middle of a page of that size, with cutting lines, the measured distance of two discs, the
/// target's axes and a ruler. Throws Error where the page is too small.
PrintPage draw_target(const DiscTarget& target, double width_mm, double height_mm);

}  // namespace berth::cli
