#pragma once

#include "berth/types.hpp"
#include "target/decode.hpp"

namespace berth {

/// Corners from a quadrilateral's sides: coarse from its words of `quads`, fine from those of `edges` (kernels/ops.h).
/// `scale`: pixels of the whole image a pixel of the level it was found in. Returns false where two sides are parallel.
bool to_candidate(const s32* quad, const s32* edge, int scale, QuadCandidate& candidate);

}  // namespace berth
