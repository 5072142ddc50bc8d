#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <exception>
#include <functional>
#include <mutex>
#include <thread>
#include <utility>
#include <vector>

#include "pipeline/thread_setup.hpp"

namespace berth::cli {

/// A thread with a queue of fixed length, for what waits for disks or networks and must hold nobody up: items lie in
/// slots that are used again, and one that finds no free slot is refused. One thread offers.
template <class Item>
class BoundedWorker {
 public:
  /// `work` gets every item in order. `tick`, where there is one, is called about every `period` besides. Both on the
  /// worker's thread; what they throw ends the work and comes out of finish.
  BoundedWorker(const char* name, std::size_t slots, std::function<void(Item&)> work,
                std::chrono::milliseconds period = std::chrono::milliseconds(0), std::function<void()> tick = {})
      : slots_(slots), work_(std::move(work)), period_(period), tick_(std::move(tick)), thread_([this, name] {
          name_thread(name);
          run();
        }) {}
  ~BoundedWorker() { stop(); }
  BoundedWorker(const BoundedWorker&) = delete;
  BoundedWorker& operator=(const BoundedWorker&) = delete;

  /// Has `fill` write an item into a free slot. False where there is none.
  template <class Fill>
  bool offer(const Fill& fill) {
    std::size_t slot = 0;
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      if (used_ == slots_.size() || ended_) return false;
      slot = (first_ + used_) % slots_.size();
    }
    fill(slots_[slot]);
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ++used_;
      ++taken_;
    }
    changed_.notify_one();
    return true;
  }

  /// Works off what was taken and ends the thread. Throws what `work` has thrown.
  void finish() {
    stop();
    if (failure_) std::rethrow_exception(std::exchange(failure_, nullptr));
  }

  /// Items that found a slot.
  std::uint64_t taken() const {
    const std::lock_guard<std::mutex> lock(mutex_);
    return taken_;
  }

 private:
  using Clock = std::chrono::steady_clock;

  void stop() {
    {
      const std::lock_guard<std::mutex> lock(mutex_);
      ended_ = true;
    }
    changed_.notify_one();
    if (thread_.joinable()) thread_.join();
  }

  void run() {
    try {
      auto next_tick = Clock::now() + period_;
      std::unique_lock<std::mutex> lock(mutex_);
      while (used_ > 0 || !ended_) {
        const auto something = [this] { return used_ > 0 || ended_; };
        if (!tick_) {
          changed_.wait(lock, something);
        } else if (Clock::now() >= next_tick || !changed_.wait_until(lock, next_tick, something)) {
          lock.unlock();
          tick_();
          next_tick = Clock::now() + period_;
          lock.lock();
          continue;
        }
        if (used_ == 0) continue;
        lock.unlock();
        work_(slots_[first_]);
        lock.lock();
        first_ = (first_ + 1) % slots_.size();
        --used_;
      }
    } catch (...) {
      const std::lock_guard<std::mutex> lock(mutex_);
      failure_ = std::current_exception();
      ended_ = true;
    }
  }

  std::vector<Item> slots_;
  std::function<void(Item&)> work_;
  std::chrono::milliseconds period_;
  std::function<void()> tick_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  std::size_t first_ = 0, used_ = 0;
  bool ended_ = false;
  std::uint64_t taken_ = 0;
  std::exception_ptr failure_;
  /// The last: it uses all the others.
  std::thread thread_;
};

}  // namespace berth::cli
