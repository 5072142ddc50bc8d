#include "support/frame_set.hpp"
#include "support/op_case.hpp"
#include "support/pictures.hpp"

namespace berth::cases {

// Outlines, holes, and contours that did not fit.
std::vector<OpCase> contour_trace_cases() { return frame_cases(Op::contour_trace); }

}  // namespace berth::cases
