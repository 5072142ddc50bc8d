#include "pilot/network_thread.hpp"

#include <cstring>
#include <future>
#include <utility>

#include "berth/error.hpp"
#include "monotonic.hpp"
#include "pipeline/thread_setup.hpp"

namespace berth {

NetworkThread::NetworkThread(Backend& backend, int width, int height, const NavigatorConfig& config)
    : navigator_(backend, width, height, config), image_(width, height) {}

void NetworkThread::start() {
  ending_ = false;
  state_ = State::free;
  error_ = nullptr;
  std::promise<void> ready;
  std::future<void> set_up = ready.get_future();
  thread_ = std::thread([this, ready = std::move(ready)]() mutable {
    try {
      name_thread("berth-network");
      make_background();
      warm_up();
      ready.set_value();
    } catch (...) {
      ready.set_exception(std::current_exception());
      return;
    }
    work();
  });
  try {
    set_up.get();
  } catch (...) {
    thread_.join();
    throw;
  }
}

/// Operations may keep memory by thread, which they take when they first run: all plans do, where a target is followed
/// that is not there.
void NetworkThread::warm_up() {
  std::memset(image_.view().data, 0, static_cast<std::size_t>(image_.width()) * image_.height());
  navigator_.expect(image_.width() / 2.0, image_.height() / 2.0, image_.height() / 4.0);
  if (navigator_.look(image_.view()).status == FrameStatus::device_lost) {
    throw Error("the network's device was lost on the first, empty frame; see berth doctor, or use another backend");
  }
  navigator_.forget();
}

void NetworkThread::stop() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ending_ = true;
    changed_.notify_all();
  }
  if (thread_.joinable()) thread_.join();
}

void NetworkThread::work() {
  for (;;) {
    {
      std::unique_lock<std::mutex> lock(mutex_);
      changed_.wait(lock, [this] { return ending_ || state_ == State::given; });
      if (ending_) return;
    }
    try {
      if (expected_) navigator_.expect(expected_->x_px, expected_->y_px, expected_->d_px);
      sighting_ = navigator_.look(image_.view(), stamp_);
    } catch (...) {
      error_ = std::current_exception();
    }
    set(State::done);
  }
}

void NetworkThread::set(State state) {
  const std::lock_guard<std::mutex> lock(mutex_);
  state_ = state;
  if (state == State::done) done_ns_ = monotonic_ns();
  changed_.notify_all();
}

bool NetworkThread::is_free() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return state_ == State::free;
}

bool NetworkThread::was_at_work_since(std::int64_t ns) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return state_ == State::given || done_ns_ >= ns;
}

void NetworkThread::give(View2D<const u8> image, const FrameStamp& stamp, const std::optional<Expectation>& expected) {
  for (int y = 0; y < image.height; ++y) {
    std::memcpy(image_.view().row(y), image.row(y), static_cast<std::size_t>(image.width));
  }
  stamp_ = stamp;
  expected_ = expected;
  set(State::given);
}

bool NetworkThread::take(Sighting& sighting, bool waiting) {
  {
    std::unique_lock<std::mutex> lock(mutex_);
    if (waiting) changed_.wait(lock, [this] { return state_ != State::given; });
    if (state_ != State::done) return false;
  }
  sighting = sighting_;
  set(State::free);
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
  return true;
}

}  // namespace berth
