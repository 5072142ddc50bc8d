#pragma once

#include <ctime>

namespace berth::bench {

/// What that clock shows, ms. CLOCK_THREAD_CPUTIME_ID: processor time of the calling thread.
inline double ms_on(clockid_t clock) {
  timespec now{};
  clock_gettime(clock, &now);
  return static_cast<double>(now.tv_sec) * 1e3 + static_cast<double>(now.tv_nsec) * 1e-6;
}

}  // namespace berth::bench
