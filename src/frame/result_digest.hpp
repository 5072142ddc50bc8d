#pragma once

#include "berth/frame.hpp"

namespace berth {

/// Of a frame's status, every marker's number, corners and pose, bundles' and targets' poses and the stages' digests
/// where they were taken, bit for bit. Allocates nothing.
u64 digest_of(const FrameResult& result);

}  // namespace berth
