#pragma once

#include <atomic>
#include <condition_variable>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <thread>
#include <vector>

#include "berth/backend.hpp"
#include "berth/health.hpp"
#include "health/memory_scrub.hpp"

namespace berth {

/// A backend that was opened anew, with all that frames need on it: what derives from this.
class Returned {
 public:
  virtual ~Returned() = default;
  /// Runs all of it once on what has a known answer; whether every answer is right.
  virtual bool is_right() = 0;
  /// Whether frames use it in place of what there was before, everywhere.
  virtual bool is_settled() const { return true; }
  /// Frees what frames used before, which is kept here once they do not.
  virtual void free_displaced() = 0;

  /// Its place in the chain.
  std::size_t number = 0;
  /// Here, not with what derives from this, so that it outlives that.
  std::unique_ptr<Backend> backend;
  /// Over the memory of it that nobody writes.
  MemoryScrub scrub;
};

/// Opens backends that were left anew, on a thread of its own that stands back for others: after a while, then less and
/// less often. wish, proven and taken are one thread's, wait for nobody and allocate nothing.
class Recovery {
 public:
  /// Makes what frames need on a backend; on the recovery's thread. Throws Error.
  using Make = std::function<std::unique_ptr<Returned>(std::unique_ptr<Backend>)>;

  /// Throws Error on a configuration out of bounds.
  Recovery(const RecoveryConfig& config, std::size_t backends, Make make);
  /// Of what took over nobody has anything any more.
  ~Recovery();
  Recovery(const Recovery&) = delete;
  Recovery& operator=(const Recovery&) = delete;
  /// Tries nothing any more; waits for a try under way.
  void stop();

  /// The backend was left.
  void wish(std::size_t backend);
  /// One that has proven itself, or null; it stays this object's.
  Returned* proven() { return proven_.load(std::memory_order_acquire); }
  /// It has taken over.
  void taken();

  /// From any thread.
  u64 tries() const { return tries_; }
  u64 returns() const { return returns_; }
  /// As HealthReport::recovery.
  const char* state() const { return waited_for_ > 0 ? "trying" : given_up_ > 0 ? "given up" : ""; }

 private:
  struct State {
    bool is_wished = false;
    std::int64_t due_ns = 0, wait_ns = 0;
    int returns = 0;
  };

  void work();
  std::size_t next() const;
  std::unique_ptr<Returned> attempt(std::size_t backend);
  void free_old();
  void put_off(State& state);

  const RecoveryConfig config_;
  const Make make_;
  std::mutex mutex_;
  std::condition_variable changed_;
  std::vector<State> states_;
  bool ending_ = false;
  std::atomic<Returned*> proven_ = nullptr;
  std::atomic<u64> tries_ = 0, returns_ = 0;
  std::atomic<int> waited_for_ = 0, given_up_ = 0;
  /// The thread's own: all that has proven itself, oldest first.
  std::vector<std::unique_ptr<Returned>> kept_;
  std::thread thread_;
};

}  // namespace berth
