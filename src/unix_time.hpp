#pragma once

#include <chrono>
#include <cstdint>

namespace berth {

/// ns since 1970 by the wall clock, which may be set at any time: for what others read, not for durations.
inline std::int64_t unix_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(std::chrono::system_clock::now().time_since_epoch())
      .count();
}

}  // namespace berth
