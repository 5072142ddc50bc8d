#include "camera/live_source.hpp"

#include <algorithm>
#include <cerrno>
#include <chrono>
#include <future>
#include <optional>
#include <string_view>
#include <utility>

#include "berth/error.hpp"
#include "camera/frame_check.hpp"
#include "monotonic.hpp"

namespace berth {
namespace {

using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr const char* kNothing = "whole frame";
constexpr milliseconds kFirstPause{50}, kLongestPause{500}, kLongestSilence{3000};

class LiveSource final : public CameraSource {
 public:
  LiveSource(LiveOptions options, LiveCameraOpener opener)
      : options_(std::move(options)), opener_(std::move(opener)), camera_(opener_()) {
    width_ = camera_->width();
    height_ = camera_->height();
  }
  ~LiveSource() override { end_.set_value(); }
  LiveSource(const LiveSource&) = delete;
  LiveSource& operator=(const LiveSource&) = delete;

  std::optional<SourceFrame> next() override {
    SourceFrame frame;
    do {
      frame.stamp = await();
      frame.image = GrayImage(width_, height_);
    } while (!fetch(frame.image.view()));
    frame.label = label_of(frame.stamp);
    return frame;
  }

  int width() const override { return width_; }
  int height() const override { return height_; }

  FrameStamp await() override {
    if (!camera_) reopen();
    const Clock::time_point deadline = Clock::now() + milliseconds(options_.watchdog_ms);
    for (;;) {
      const int error = take_newest(awaited_, deadline);
      if (error != 0 && error != ETIMEDOUT) lose(camera_->explain(error));
      if (error == 0) {
        if (!awaited_.damaged && is_in_time(awaited_)) return stamp(awaited_);
        if (awaited_.damaged) count(health_.incomplete, "whole frame");
        if (const int refused = camera_->give_back(awaited_)) lose(camera_->explain(refused));
      }
      // A camera whose frames are all damaged, or none of whose times can be, is of no more use than one that gives
      // none.
      if (Clock::now() >= deadline) lose_for_silence();
    }
  }

  bool fetch(View2D<u8> image) override {
    if (image.width != width_ || image.height != height_) {
      lose("its images are " + std::to_string(width_) + "x" + std::to_string(height_) + " now, not " +
           std::to_string(image.width) + "x" + std::to_string(image.height) + "; say which by width and height");
    }
    const bool is_whole = camera_->read(awaited_, image);
    if (!is_whole) count(health_.incomplete, "whole frame");
    if (const int refused = camera_->give_back(awaited_)) lose(camera_->explain(refused));
    const bool is_repeat = is_whole && !options_.repeats && repeat_check_.is_repeat(image);
    if (is_repeat) count(health_.repeated, "new picture");
    if (is_whole && !is_repeat) {
      pause_ = kFirstPause;
      useless_since_.reset();
      lacks_ = kNothing;
      return true;
    }
    const Clock::time_point now = Clock::now();
    if (!useless_since_) useless_since_ = now;
    if (now - *useless_since_ >= milliseconds(options_.watchdog_ms)) lose_for_silence();
    return false;
  }

  std::string label_of(const FrameStamp& stamp) const override {
    return options_.name + "#" + std::to_string(stamp.sequence);
  }

  SourceHealth health() const override { return health_; }

 private:
  /// Waits for the camera as long as there is nothing to complain of.
  void reopen() {
    const Clock::time_point until = Clock::now() + kLongestSilence;
    while (!camera_) {
      if (!opening_.valid()) begin_opening();
      if (opening_.wait_until(until) != std::future_status::ready) {
        throw Error(options_.name + ": the camera is not back yet; it is opened again as soon as it is");
      }
      try {
        camera_ = opening_.get();
      } catch (const Error&) {
        if (!has_complained_ || Clock::now() >= until) {
          has_complained_ = true;
          throw;
        }
      }
    }
    has_sequence_ = false;
    time_check_.begin_anew();
    ++health_.reopened;
    width_ = camera_->width();
    height_ = camera_->height();
  }

  void begin_opening() {
    opening_ = std::async(std::launch::async, [this, pause = pause_]() -> std::unique_ptr<LiveCamera> {
      if (ended_.wait_for(pause) == std::future_status::ready) return nullptr;
      return opener_();
    });
    pause_ = std::min(2 * pause_, kLongestPause);
  }

  [[noreturn]] void lose_for_silence() {
    lose(std::string("no ") + lacks_ + " for " + std::to_string(options_.watchdog_ms) + " ms");
  }

  /// A frame of no use, and what it is not.
  void count(u64& counted, const char* lacks) {
    ++counted;
    lacks_ = lacks;
  }

  bool is_in_time(const LiveCamera::Filled& filled) {
    const bool same_clock = std::string_view(filled.clock) == "monotonic";
    switch (time_check_.look(filled.time_ns, monotonic_ns(), same_clock)) {
      case TimeVerdict::fine:
        return true;
      case TimeVerdict::again:
        count(health_.repeated, "new frame");
        return false;
      case TimeVerdict::back:
        count(health_.misdated, "frame whose time goes on");
        return false;
      case TimeVerdict::ahead:
        break;
    }
    count(health_.misdated, "frame whose time is not ahead of the clock");
    return false;
  }

  [[noreturn]] void lose(const std::string& why) {
    // One that is still being closed has had the whole life of this one for it.
    closing_ = std::async(std::launch::async, [camera = std::move(camera_)]() mutable { camera.reset(); });
    if (!options_.closes_aside) closing_.get();
    useless_since_.reset();
    lacks_ = kNothing;
    has_complained_ = false;
    throw Error(options_.name + ": the camera is lost (" + why + "); it is opened again as soon as it is back");
  }

  /// The last of the frames that are there, of undamaged ones if there is any; waits until then for the first.
  int take_newest(LiveCamera::Filled& newest, Clock::time_point deadline) {
    const auto left = std::chrono::duration_cast<milliseconds>(deadline - Clock::now()).count();
    if (const int error = camera_->take(static_cast<int>(std::max<std::int64_t>(left, 0)), newest)) return error;
    count_lost(newest);
    // At most one turn of the ring: a camera that is faster than this loop does not hold it up.
    for (int i = 1; i < options_.buffers; ++i) {
      LiveCamera::Filled newer;
      if (camera_->take(0, newer) != 0) break;
      count_lost(newer);
      const bool keeps = newer.damaged && !newest.damaged;
      const LiveCamera::Filled& other = keeps ? newer : newest;
      ++(other.damaged ? health_.incomplete : health_.skipped);
      if (const int error = camera_->give_back(other)) return error;
      if (!keeps) newest = newer;
    }
    return 0;
  }

  void count_lost(const LiveCamera::Filled& filled) {
    // A driver that does not count, or began anew, has lost nothing.
    const std::uint32_t gap = filled.sequence - last_sequence_ - 1;
    if (has_sequence_ && gap < 0x80000000U) health_.lost += gap;
    last_sequence_ = filled.sequence;
    has_sequence_ = true;
  }

  FrameStamp stamp(const LiveCamera::Filled& filled) {
    const std::int64_t exposure_ns = camera_->exposure_ns();
    FrameStamp stamp;
    stamp.sequence = sequence_++;
    stamp.exposure_start_ns = filled.from_start ? filled.time_ns : filled.time_ns - exposure_ns;
    stamp.mid_exposure_ns = stamp.exposure_start_ns + exposure_ns / 2;
    stamp.arrival_ns = monotonic_ns();
    stamp.clock = filled.clock;
    return stamp;
  }

  const LiveOptions options_;
  const LiveCameraOpener opener_;
  std::unique_ptr<LiveCamera> camera_;
  int width_ = 0, height_ = 0;
  LiveCamera::Filled awaited_;
  std::optional<Clock::time_point> useless_since_;
  const char* lacks_ = kNothing;  // what the camera has not given since the last good frame
  TimeCheck time_check_;
  RepeatCheck repeat_check_;  // of all times that it was opened: one that hangs hangs on
  SourceHealth health_;
  milliseconds pause_ = kFirstPause;
  bool has_complained_ = false;
  u64 sequence_ = 0;
  std::uint32_t last_sequence_ = 0;
  bool has_sequence_ = false;
  std::promise<void> end_;
  const std::future<void> ended_ = end_.get_future();
  // Last, so that what their threads use outlives them.
  std::future<std::unique_ptr<LiveCamera>> opening_;
  std::future<void> closing_;
};

}  // namespace

std::unique_ptr<CameraSource> open_live(const LiveOptions& options, LiveCameraOpener opener) {
  return std::make_unique<LiveSource>(options, std::move(opener));
}

}  // namespace berth
