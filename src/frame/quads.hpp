#pragma once

#include "berth/types.hpp"
#include "target/decode.hpp"

namespace berth {

/// Corners from a quadrilateral's sides: coarse from its words of `quads`, fine from those of `edges` (kernels/ops.h).
/// Returns false where two sides are parallel.
bool to_candidate(const s32* quad, const s32* edge, QuadCandidate& candidate);

}  // namespace berth
