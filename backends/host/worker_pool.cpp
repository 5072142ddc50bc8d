#include "host/worker_pool.hpp"

#include <algorithm>

namespace berth::host {

WorkerPool::WorkerPool(int threads) {
  const int all = threads > 0 ? threads : std::max(1, static_cast<int>(std::thread::hardware_concurrency()));
  for (int part = 1; part < all; ++part) workers_.emplace_back([this, part] { serve(part); });
}

WorkerPool::~WorkerPool() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    stop_ = true;
  }
  start_.notify_all();
  for (std::thread& worker : workers_) worker.join();
}

void WorkerPool::share(int groups, const std::function<void(int, int)>& work) {
  if (workers_.empty() || groups < 2) {
    work(0, groups);
    return;
  }
  const std::lock_guard<std::mutex> turn(turn_);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    work_ = &work;
    groups_ = groups;
    busy_ = static_cast<int>(workers_.size());
    ++round_;
  }
  start_.notify_all();
  run_part(0);
  std::unique_lock<std::mutex> lock(mutex_);
  done_.wait(lock, [this] { return busy_ == 0; });
}

void WorkerPool::serve(int part) {
  unsigned seen = 0;
  for (;;) {
    std::unique_lock<std::mutex> lock(mutex_);
    start_.wait(lock, [&] { return stop_ || round_ != seen; });
    if (stop_) return;
    seen = round_;
    lock.unlock();
    run_part(part);
    lock.lock();
    if (--busy_ == 0) done_.notify_one();
  }
}

void WorkerPool::run_part(int part) const {
  const long long groups = groups_;
  const int first = static_cast<int>(groups * part / threads());
  const int last = static_cast<int>(groups * (part + 1) / threads());
  if (first < last) (*work_)(first, last);
}

}  // namespace berth::host
