#pragma once

#include <array>
#include <condition_variable>
#include <cstddef>
#include <mutex>
#include <vector>

#include "berth/pipeline.hpp"

namespace berth {

/// A queue of slots with room for all of them.
class SlotQueue {
 public:
  explicit SlotQueue(int slots) : slots_(static_cast<std::size_t>(slots)) {}

  bool empty() const { return size_ == 0; }
  int front() const { return slots_[first_]; }
  void push(int slot) {
    slots_[(first_ + size_) % slots_.size()] = slot;
    ++size_;
  }
  int pop() {
    const int slot = front();
    first_ = (first_ + 1) % slots_.size();
    --size_;
    return slot;
  }

 private:
  std::vector<int> slots_;
  std::size_t first_ = 0, size_ = 0;
};

/// Which slot is whose: handed from the camera's thread to the device's, the host's, the reader, and back. At most all
/// but one are past waiting, so that the newest frame always finds one. Every lock is held for a few moves of indices.
class SlotRing {
 public:
  /// At most `most_unsettled` frames are past waiting whose result is not settled yet; 0 for no bound.
  SlotRing(int slots, Overrun overrun, int most_unsettled = 0);

  /// The camera's thread. A slot to fill; −1 once the ring is closed. Asked again before commit it gives the same.
  int begin();
  /// What was begun waits for the device now. False once the ring is closed.
  bool commit();

  /// The device's thread. What to run next, waiting for it; −1 at the end. `again` is true for a frame that has been on
  /// a device before.
  int take(bool& again);
  /// It is enqueued, or done where enqueueing does the work.
  void on_device(int slot);

  /// The host's thread. The oldest frame that the device has, waiting for it; −1 at the end.
  int await();
  /// Has that frame run again by the device's thread, and waits until it is enqueued.
  void run_again(int slot);
  /// Its result stands, and later frames may go by it. Where it is not said, done() says it.
  void settled();
  /// It has arrived and is being finished; it is being delivered.
  void on_host() { set_oldest(Oldest::host); }
  void delivering() { set_oldest(Oldest::reader); }
  /// It is through: free again, or for the reader to fetch.
  void done(int slot, bool for_reader);

  /// The reader. The oldest result, −1 where there is none yet or at the end; gives back the one before.
  int fetch(bool waiting);

  /// No more frames.
  void close();
  /// No more results for the reader either: those not fetched are dropped, as are those to come.
  void discard();
  /// As new. Only when closed and at its end.
  void reopen();

  /// offered, delivered, dropped.
  PipelineCounts counts() const;

 private:
  enum class Oldest { device, host, reader };

  bool at_end() const { return closed_ && waiting_.empty() && under_way_ == 0; }
  bool has_slot() const { return taken_ + 1 < slots_; }
  bool awaits_results() const { return most_unsettled_ > 0 && unsettled_ == most_unsettled_; }
  bool may_take() const { return !waiting_.empty() && has_slot() && !awaits_results(); }
  void settle();
  DropCause cause() const;
  void drop(int slot, DropCause cause);
  void set_oldest(Oldest oldest);
  void wake_all();

  const int slots_;
  const int most_unsettled_;
  const Overrun overrun_;
  mutable std::mutex mutex_;
  std::condition_variable room_, for_device_, for_host_, for_reader_;
  SlotQueue free_, waiting_, on_device_, unread_;
  /// One at a time each: being filled; to be run again, and until it is enqueued; with the reader.
  int filling_ = -1, again_ = -1, rerunning_ = -1, reading_ = -1;
  /// Slots past waiting; of these, those that the reader does not have yet; of these, those without a settled result.
  int taken_ = 0, under_way_ = 0, unsettled_ = 0;
  bool is_oldest_settled_ = false;
  /// Whether the device's thread is at work, and where the oldest frame under way is.
  bool enqueueing_ = false;
  Oldest oldest_ = Oldest::device;
  bool closed_ = false, discarding_ = false;
  PipelineCounts counts_;
};

}  // namespace berth
