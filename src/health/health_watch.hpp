#pragma once

#include <atomic>
#include <memory>
#include <optional>
#include <vector>

#include "berth/health.hpp"
#include "health/known_answer.hpp"
#include "health/memory_scrub.hpp"
#include "health/recovery.hpp"

namespace berth {

/// The configuration itself. Throws Error where it is out of bounds.
const HealthConfig& checked_health(const HealthConfig& config);

/// Which of several backends can still be believed, by what was lost, answered and found in memory. Counts may be read
/// by any thread; all else is one thread's. Allocates nothing after start.
class HealthWatch {
 public:
  /// Without a configuration only losses are kept account of. Throws Error as Detector.
  HealthWatch(const std::optional<HealthConfig>& config, int width, int height, const DetectorConfig& detector,
              std::size_t backends);

  bool is_on() const { return known_ != nullptr; }
  /// Memory to check: of one backend's detector, or all of theirs (MemoryScrub::kShared).
  void watch(const std::vector<ConstantMemory>& memory, int owner);
  /// Where a recovery is configured: from now on, backends that are left are tried again. `make` must not outlive what
  /// it uses.
  void recover_by(Recovery::Make make);
  /// No backend is tried any more; waits for a try under way.
  void stop_recovery();
  /// One that was left and has proven itself since, or null. To be put in place of what there was, then taken back.
  Returned* proven() { return recovery_ ? recovery_->proven() : nullptr; }
  void take_back(Returned& returned);

  const KnownAnswer& known() const { return *known_; }
  /// What is to be asked beside the whole frame this time: each of the known answer's windows in turn.
  std::size_t next_windows();
  /// Whether the known answer is due, on `now_ns` of the monotonic clock.
  bool is_due(std::int64_t now_ns) const;
  /// Whether a backend answered rightly, or lost its device.
  void answer(std::size_t backend, bool is_right, bool is_lost, std::int64_t now_ns);
  /// The next slice of memory.
  void scrub();
  void lose(std::size_t backend) { leave(backend, "its device was lost"); }
  void note_hang(std::size_t backend) { leave(backend, "its device hangs"); }

  bool is_good(std::size_t backend) const { return good_[backend]; }
  /// The first that can be believed; how many backends there are where none can.
  std::size_t active() const { return active_.load(std::memory_order_acquire); }
  bool has_failed() const { return active() == good_.size(); }
  HealthReport report() const;

 private:
  void leave(std::size_t backend, const char* reason);
  void find_active();
  void count_watched();
  MemoryScrub& scrub_of(int owner) { return scrubs_[static_cast<std::size_t>(owner - MemoryScrub::kShared)]; }

  HealthConfig config_;
  std::unique_ptr<const KnownAnswer> known_;
  /// What all use, then each backend's.
  std::vector<MemoryScrub> scrubs_;
  std::size_t scrubbed_ = 0;  // the one at hand
  std::size_t windows_ = 0;
  std::vector<char> good_;
  std::int64_t answered_ns_ = 0;
  std::atomic<std::size_t> active_ = 0;
  std::atomic<const char*> reason_ = "";
  std::atomic<u64> answers_ = 0, wrong_ = 0, checked_ = 0, altered_ = 0;
  std::atomic<std::size_t> watched_ = 0;
  std::unique_ptr<Recovery> recovery_;
};

}  // namespace berth
