#include "support/frame_set.hpp"
#include "support/op_case.hpp"
#include "support/pictures.hpp"

namespace berth::cases {

// Every frame of the set: rows that end black, overflow, single rows and columns.
std::vector<OpCase> run_emit_cases() { return frame_cases(Op::run_emit); }

}  // namespace berth::cases
