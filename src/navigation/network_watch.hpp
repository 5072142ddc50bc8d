#pragma once

#include <array>
#include <atomic>
#include <vector>

#include "berth/health.hpp"
#include "health/memory_scrub.hpp"
#include "navigation/navigator_plans.hpp"

namespace berth {

/// Whether a network's plans can still be believed: by memory checked and by a picture whose sums are known. Allocates
/// nothing after start.
class NetworkWatch {
 public:
  /// Of the sums of the search, the close looks and the look that follows.
  using Answer = std::array<u32, 3>;

  /// Runs the picture on the `cpu` backend, with all the plans' memory for that time, and then on these: seconds with a
  /// large network. Throws Error on a configuration out of bounds.
  NetworkWatch(const HealthConfig& config, NavigatorPlans& plans);

  /// Checks the next slice of memory, and where it is due runs the picture over what the plans hold. False for good
  /// once either was wrong.
  bool is_believed(NavigatorPlans& plans);
  /// From any thread.
  HealthReport report() const;

 private:
  void ask(NavigatorPlans& plans);

  HealthConfig config_;
  std::vector<u8> picture_;  // padded as the plans' frame
  Answer expected_ = {};
  MemoryScrub scrub_;
  std::int64_t answered_ns_ = 0;
  std::atomic<const char*> reason_ = "";  // empty as long as it is believed
  std::atomic<u64> answers_ = 0, wrong_ = 0, checked_ = 0, altered_ = 0;
};

}  // namespace berth
