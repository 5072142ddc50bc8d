#include <algorithm>
#include <cerrno>
#include <chrono>
#include <cstring>
#include <ctime>
#include <thread>

#include "berth/error.hpp"
#include "camera/sources.hpp"

namespace berth {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

// A signal is seen to after this time at the latest.
constexpr int kSlice_ms = 100;
constexpr milliseconds kFirstPause{50}, kLongestPause{2000};

std::int64_t monotonic_ns() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return std::int64_t{now.tv_sec} * 1'000'000'000 + now.tv_nsec;
}

class V4l2Source final : public Source {
 public:
  V4l2Source(V4l2Options options, V4l2Opener opener) : options_(std::move(options)), opener_(std::move(opener)) {
    open();
  }

  std::optional<SourceFrame> next() override {
    if (!camera_) reopen();
    for (Clock::time_point deadline = Clock::now() + milliseconds(options_.watchdog_ms);;) {
      V4l2Camera::Filled newest;
      const int error = take_newest(newest);
      if (error == ETIMEDOUT && Clock::now() < deadline) continue;
      if (error == ETIMEDOUT) lose("no frame for " + std::to_string(options_.watchdog_ms) + " ms");
      if (error != 0) lose(std::strerror(error));
      SourceFrame frame;
      const bool whole = !newest.damaged && camera_->read(newest, frame.image);
      stamp(newest, frame);
      if (const int refused = camera_->give_back(newest)) lose(std::strerror(refused));
      pause_ = kFirstPause;
      if (whole) return frame;
      ++health_.incomplete;
    }
  }

  SourceHealth health() const override { return health_; }

 private:
  void open() {
    camera_ = std::make_unique<V4l2Camera>(opener_(options_.path), options_);
    has_sequence_ = false;
  }

  void reopen() {
    std::this_thread::sleep_for(pause_);
    pause_ = std::min(2 * pause_, kLongestPause);
    open();
    ++health_.reopened;
  }

  [[noreturn]] void lose(const std::string& why) {
    camera_.reset();
    throw Error(options_.path + ": the camera is lost (" + why + "); it is opened again as soon as it is back");
  }

  /// The last of the frames that are there; waits a while for the first.
  int take_newest(V4l2Camera::Filled& newest) {
    if (const int error = camera_->take(std::min(kSlice_ms, options_.watchdog_ms), newest)) return error;
    count_lost(newest);
    // At most one turn of the ring: a camera that is faster than this loop does not hold it up.
    for (int i = 1; i < options_.buffers; ++i) {
      V4l2Camera::Filled newer;
      if (camera_->take(0, newer) != 0) break;
      count_lost(newer);
      ++health_.skipped;
      if (const int error = camera_->give_back(newest)) return error;
      newest = newer;
    }
    return 0;
  }

  void count_lost(const V4l2Camera::Filled& filled) {
    // In 32 bits, as the driver counts; a driver that does not count, or began anew, has lost nothing.
    const std::uint32_t gap = filled.sequence - last_sequence_ - 1;
    if (has_sequence_ && gap < 0x80000000U) health_.lost += gap;
    last_sequence_ = filled.sequence;
    has_sequence_ = true;
  }

  void stamp(const V4l2Camera::Filled& filled, SourceFrame& frame) {
    const std::int64_t exposure_ns = camera_->exposure_ns();
    FrameStamp& stamp = frame.stamp;
    stamp.sequence = sequence_++;
    stamp.exposure_start_ns = filled.from_start ? filled.time_ns : filled.time_ns - exposure_ns;
    stamp.mid_exposure_ns = stamp.exposure_start_ns + exposure_ns / 2;
    stamp.arrival_ns = monotonic_ns();
    stamp.clock = filled.monotonic ? "monotonic" : "driver";
    frame.label = options_.path + "#" + std::to_string(stamp.sequence);
  }

  V4l2Options options_;
  V4l2Opener opener_;
  std::unique_ptr<V4l2Camera> camera_;
  SourceHealth health_;
  milliseconds pause_ = kFirstPause;
  u64 sequence_ = 0;
  std::uint32_t last_sequence_ = 0;
  bool has_sequence_ = false;
};

}  // namespace

std::unique_ptr<Source> open_v4l2(const V4l2Options& options, V4l2Opener opener) {
  return std::make_unique<V4l2Source>(options, std::move(opener));
}

}  // namespace berth
