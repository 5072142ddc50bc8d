#include "paced_camera.hpp"

#include <chrono>
#include <exception>
#include <future>
#include <utility>

#include "monotonic.hpp"
#include "pipeline/thread_setup.hpp"

namespace berth::cli {

void PacedCamera::start(Push push, std::function<void()> at_end) {
  std::promise<void> ready;
  std::future<void> set = ready.get_future();
  thread_ = std::thread([this, push = std::move(push), at_end = std::move(at_end), ready = std::move(ready)]() mutable {
    try {
      name_thread("berth-camera");
      if (realtime_ > 0) make_realtime(realtime_);
      ready.set_value();
    } catch (...) {
      ready.set_exception(std::current_exception());
      return;
    }
    play(push);
    at_end();
  });
  set.get();
}

void PacedCamera::play(const Push& push) {
  const auto began = std::chrono::steady_clock::now();
  const double period_ns = 1e9 / fps_;
  for (std::uint64_t i = 0; i < frames_ && !ended_; ++i) {
    const std::chrono::nanoseconds since(static_cast<std::int64_t>(static_cast<double>(i) * period_ns));
    const auto due = began + since;
    std::this_thread::sleep_until(due);
    FrameStamp stamp;
    stamp.sequence = i;
    stamp.clock = "monotonic";
    stamp.mid_exposure_ns = std::chrono::nanoseconds(due.time_since_epoch()).count();
    stamp.exposure_start_ns = stamp.mid_exposure_ns;
    stamp.arrival_ns = monotonic_ns();
    if (static_cast<double>(stamp.arrival_ns - stamp.mid_exposure_ns) > period_ns) ++late_;
    if (!push(i, stamp)) return;
  }
}

}  // namespace berth::cli
