#pragma once

#include <chrono>
#include <cstdint>

namespace berth {

/// ns on the clock that FrameStamp calls "monotonic".
inline std::int64_t monotonic_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

}  // namespace berth
