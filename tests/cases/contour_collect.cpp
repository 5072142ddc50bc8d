#include "support/frame_set.hpp"
#include "support/op_case.hpp"
#include "support/pictures.hpp"

namespace berth::cases {

// Overflow of contours and of points, empty slots behind the last contour.
std::vector<OpCase> contour_collect_cases() { return frame_cases(Op::contour_collect); }

}  // namespace berth::cases
