#include "support/frame_set.hpp"
#include "support/op_case.hpp"
#include "support/pictures.hpp"

namespace berth::cases {

// Combs, nested frames, checkerboards and noise make every kind of overlap; overflow drops rows.
std::vector<OpCase> run_link_cases() { return frame_cases(Op::run_link); }

}  // namespace berth::cases
