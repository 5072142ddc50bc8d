#pragma once

#include <condition_variable>
#include <functional>
#include <mutex>
#include <thread>
#include <vector>

namespace berth::host {

/// Threads that share the groups of one operation at a time. The caller works too.
class WorkerPool {
 public:
  /// `threads` in all, the caller included; 0 for every core.
  explicit WorkerPool(int threads);
  ~WorkerPool();
  WorkerPool(const WorkerPool&) = delete;
  WorkerPool& operator=(const WorkerPool&) = delete;

  int threads() const { return static_cast<int>(workers_.size()) + 1; }
  /// Calls work(first, last) for parts of [0, groups) that together make the whole, and returns when all are done.
  /// May be called by several threads at once, as streams of one backend are: they take turns.
  /// Which thread does which part never changes a result: operations do not depend on the order of their groups.
  void share(int groups, const std::function<void(int, int)>& work);

 private:
  void serve(int part);
  void run_part(int part) const;

  std::mutex turn_;   // held by the caller whose operation the threads are at
  std::mutex mutex_;  // of what follows
  std::condition_variable start_;
  std::condition_variable done_;
  const std::function<void(int, int)>* work_ = nullptr;
  int groups_ = 0;
  unsigned round_ = 0;
  int busy_ = 0;
  bool stop_ = false;
  std::vector<std::thread> workers_;
};

}  // namespace berth::host
