#pragma once

#include "berth/types.hpp"
#include "target/decode.hpp"

namespace berth {

/// Corners from a quadrilateral's sides: coarse from its words of `quads`, fine from those of `edges` (kernels/ops.h).
/// `scale`: pixels of the whole image a pixel of the level it was found in; `x`, `y`: where in the frame that image
/// begins, px. Returns false where two sides are parallel.
bool to_candidate(const s32* quad, const s32* edge, int scale, int x, int y, QuadCandidate& candidate);

/// Whether the image's border cuts the quadrilateral off: the middle of a side lies within two pixels of it. Such a
/// side is the image's, not the marker's, and a pose from it would be silently wrong. A single corner may lie outside.
bool is_cut_off(const QuadCandidate& candidate, int width, int height);

}  // namespace berth
