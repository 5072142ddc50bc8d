#include "pipeline/device_waiter.hpp"

#include <chrono>
#include <utility>

#include "pipeline/thread_setup.hpp"

namespace berth {

DeviceWaiter::DeviceWaiter() : thread_([this] { work(); }) {}

void DeviceWaiter::end() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ending_ = true;
    given_.notify_one();
  }
  if (thread_.joinable()) thread_.join();
}

void DeviceWaiter::work() {
  name_thread("berth-wait");
  std::unique_lock<std::mutex> lock(mutex_);
  for (;;) {
    given_.wait(lock, [this] { return frame_ != nullptr || ending_; });
    if (frame_ == nullptr) return;
    DeviceFrame& frame = *frame_;
    lock.unlock();
    bool is_alive = false;
    try {
      is_alive = frame.finish();
    } catch (...) {
      is_alive = false;  // a backend that throws here is no use to anyone
    }
    lock.lock();
    is_alive_ = is_alive;
    frame_ = nullptr;
    ended_.notify_one();
  }
}

DeviceWaiter::End DeviceWaiter::finish(DeviceFrame& frame, std::int64_t most_ns) {
  std::unique_lock<std::mutex> lock(mutex_);
  if (hangs_) return End::hangs;
  frame_ = &frame;
  given_.notify_one();
  hangs_ = !ended_.wait_for(lock, std::chrono::nanoseconds(most_ns), [this] { return frame_ == nullptr; });
  return hangs_ ? End::hangs : is_alive_ ? End::done : End::lost;
}

DeviceWaiters::DeviceWaiters(std::size_t backends, std::int64_t most_ns, std::size_t most_returns) : most_ns_(most_ns) {
  if (most_ns == 0) return;
  all_.reserve(backends * (1 + most_returns));
  for (std::size_t i = 0; i < backends; ++i) all_.push_back(make());
  waiters_ = all_;
}

DeviceWaiters::~DeviceWaiters() {
  for (const auto& waiter : all_) waiter->end();
}

DeviceWaiter::End DeviceWaiters::finish(std::size_t backend, DeviceFrame& frame) {
  using End = DeviceWaiter::End;
  if (waiters_.empty() || frame.stream().is_immediate()) return frame.finish() ? End::done : End::lost;
  return waiters_[backend]->finish(frame, most_ns_);
}

std::shared_ptr<DeviceWaiter> DeviceWaiters::make() const {
  return most_ns_ > 0 ? std::make_shared<DeviceWaiter>() : nullptr;
}

void DeviceWaiters::exchange(std::size_t backend, std::shared_ptr<DeviceWaiter>& waiter) {
  if (waiters_.empty()) return;
  std::swap(waiters_[backend], waiter);
  all_.push_back(waiters_[backend]);
}

}  // namespace berth
