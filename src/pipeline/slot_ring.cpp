#include "pipeline/slot_ring.hpp"

#include <cassert>

namespace berth {

SlotRing::SlotRing(int slots, Overrun overrun, int most_unsettled)
    : slots_(slots),
      most_unsettled_(most_unsettled),
      overrun_(overrun),
      free_(slots),
      waiting_(slots),
      on_device_(slots),
      unread_(slots) {
  for (int slot = 0; slot < slots; ++slot) free_.push(slot);
}

int SlotRing::begin() {
  std::unique_lock<std::mutex> lock(mutex_);
  if (filling_ >= 0 && !closed_) return filling_;
  if (overrun_ == Overrun::wait) room_.wait(lock, [this] { return closed_ || !free_.empty(); });
  if (closed_) return -1;
  if (free_.empty()) drop(waiting_.pop(), cause());  // one waits: all but one at most are past that
  filling_ = free_.pop();
  return filling_;
}

bool SlotRing::commit() {
  const std::lock_guard<std::mutex> lock(mutex_);
  assert(filling_ >= 0);
  const int slot = filling_;
  filling_ = -1;
  if (closed_) {
    free_.push(slot);
    return false;
  }
  if (overrun_ == Overrun::newest && !waiting_.empty()) drop(waiting_.pop(), cause());
  waiting_.push(slot);
  ++counts_.offered;
  for_device_.notify_one();
  return true;
}

int SlotRing::take(bool& again) {
  std::unique_lock<std::mutex> lock(mutex_);
  for_device_.wait(lock, [this] { return again_ >= 0 || may_take() || at_end(); });
  again = again_ >= 0;
  if (again) {
    const int slot = again_;
    again_ = -1;
    enqueueing_ = true;
    return slot;
  }
  if (!may_take()) return -1;
  ++taken_;
  ++under_way_;
  ++unsettled_;
  enqueueing_ = true;
  return waiting_.pop();
}

void SlotRing::on_device(int slot) {
  const std::lock_guard<std::mutex> lock(mutex_);
  enqueueing_ = false;
  // One that runs again is at the front already.
  if (rerunning_ == slot) {
    rerunning_ = -1;
  } else {
    on_device_.push(slot);
  }
  for_host_.notify_one();
}

int SlotRing::await() {
  std::unique_lock<std::mutex> lock(mutex_);
  oldest_ = Oldest::device;
  for_host_.wait(lock, [this] { return !on_device_.empty() || at_end(); });
  return on_device_.empty() ? -1 : on_device_.front();
}

void SlotRing::run_again(int slot) {
  std::unique_lock<std::mutex> lock(mutex_);
  again_ = rerunning_ = slot;
  for_device_.notify_one();
  for_host_.wait(lock, [this] { return rerunning_ < 0; });
}

void SlotRing::settled() {
  const std::lock_guard<std::mutex> lock(mutex_);
  settle();
}

void SlotRing::settle() {
  if (is_oldest_settled_) return;
  is_oldest_settled_ = true;
  --unsettled_;
  for_device_.notify_one();
}

void SlotRing::done(int slot, bool for_reader) {
  const std::lock_guard<std::mutex> lock(mutex_);
  assert(on_device_.front() == slot);
  settle();
  is_oldest_settled_ = false;
  on_device_.pop();
  --under_way_;
  if (discarding_) {
    --taken_;
    drop(slot, DropCause::reader);
  } else if (for_reader) {
    unread_.push(slot);
    for_reader_.notify_one();
  } else {
    --taken_;
    free_.push(slot);
    ++counts_.delivered;
  }
  oldest_ = Oldest::device;
  room_.notify_one();
  for_device_.notify_one();
  if (at_end()) wake_all();
}

int SlotRing::fetch(bool waiting) {
  std::unique_lock<std::mutex> lock(mutex_);
  if (reading_ >= 0) {
    free_.push(reading_);
    reading_ = -1;
    --taken_;
    room_.notify_one();
    for_device_.notify_one();
  }
  if (waiting) for_reader_.wait(lock, [this] { return !unread_.empty() || at_end(); });
  if (unread_.empty()) return -1;
  reading_ = unread_.pop();
  ++counts_.delivered;
  return reading_;
}

void SlotRing::close() {
  const std::lock_guard<std::mutex> lock(mutex_);
  closed_ = true;
  wake_all();
}

void SlotRing::discard() {
  const std::lock_guard<std::mutex> lock(mutex_);
  discarding_ = true;
  while (!unread_.empty()) {
    --taken_;
    drop(unread_.pop(), DropCause::reader);
  }
  wake_all();
}

void SlotRing::reopen() {
  const std::lock_guard<std::mutex> lock(mutex_);
  assert(at_end());
  if (reading_ >= 0) {
    free_.push(reading_);
    reading_ = -1;
    --taken_;
  }
  closed_ = discarding_ = false;
  counts_ = {};
}

PipelineCounts SlotRing::counts() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return counts_;
}

DropCause SlotRing::cause() const {
  if (enqueueing_ || (has_slot() && !awaits_results())) return DropCause::device;
  // Where a result is awaited, fetching others would help nothing.
  const bool is_unread = !has_slot() && (!unread_.empty() || reading_ >= 0);
  if (is_unread || oldest_ == Oldest::reader) return DropCause::reader;
  return oldest_ == Oldest::host ? DropCause::host : DropCause::device;
}

void SlotRing::drop(int slot, DropCause cause) {
  free_.push(slot);
  ++counts_.dropped[static_cast<std::size_t>(cause)];
}

void SlotRing::set_oldest(Oldest oldest) {
  const std::lock_guard<std::mutex> lock(mutex_);
  oldest_ = oldest;
}

void SlotRing::wake_all() {
  room_.notify_all();
  for_device_.notify_all();
  for_host_.notify_all();
  for_reader_.notify_all();
}

}  // namespace berth
