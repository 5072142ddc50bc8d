#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <vector>

#include "berth/health.hpp"
#include "health/known_answer.hpp"
#include "health/memory_scrub.hpp"

namespace berth {

/// Which of several backends can still be believed, by what was lost, answered and found in memory. Counts may be read
/// by any thread; all else is one thread's. Allocates nothing after start.
class HealthWatch {
 public:
  /// Without a configuration only losses are kept account of. Throws Error as Detector.
  HealthWatch(const std::optional<HealthConfig>& config, int width, int height, const DetectorConfig& detector,
              std::size_t backends);

  bool is_on() const { return known_ != nullptr; }
  /// Memory to check: of one backend's detector, or all of theirs (MemoryScrub::kShared).
  void watch(const std::vector<ConstantMemory>& memory, int owner) { scrub_.add(memory, owner); }

  View2D<const u8> picture() const { return known_->image(); }
  /// Whether the known answer is due, on `now_ns` of the monotonic clock.
  bool is_due(std::int64_t now_ns) const;
  /// What a backend made of the picture; whether that is right.
  bool answer(std::size_t backend, const FrameResult& result, std::int64_t now_ns);
  /// The next slice of memory.
  void scrub();
  void lose(std::size_t backend) { leave(backend, "its device was lost"); }

  bool is_good(std::size_t backend) const { return good_[backend]; }
  /// The first that can be believed; how many backends there are where none can.
  std::size_t active() const { return active_.load(std::memory_order_acquire); }
  bool has_failed() const { return active() == good_.size(); }
  HealthReport report() const;

 private:
  void leave(std::size_t backend, const char* reason);

  HealthConfig config_;
  std::unique_ptr<const KnownAnswer> known_;
  MemoryScrub scrub_;
  std::vector<char> good_;
  std::int64_t answered_ns_ = 0;
  std::atomic<std::size_t> active_ = 0;
  std::atomic<const char*> reason_ = "";
  std::atomic<u64> answers_ = 0, wrong_ = 0, checked_ = 0, altered_ = 0;
};

}  // namespace berth
