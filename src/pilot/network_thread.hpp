#pragma once

#include <condition_variable>
#include <cstdint>
#include <exception>
#include <mutex>
#include <optional>
#include <thread>

#include "berth/navigator.hpp"
#include "pilot/judgement.hpp"

namespace berth {

/// A navigator on a thread of its own, which stands back for others: one look at a time. All calls are of one thread,
/// but for start and stop, which come before and after them. Nothing is allocated in between.
class NetworkThread {
 public:
  NetworkThread(Backend& backend, int width, int height, const NavigatorConfig& config);
  ~NetworkThread() { stop(); }
  NetworkThread(const NetworkThread&) = delete;
  NetworkThread& operator=(const NetworkThread&) = delete;

  /// Starts the thread, with nothing known of earlier frames. Throws Error where the device is lost.
  void start();
  bool is_started() const { return thread_.joinable(); }
  /// Waits for a look under way, and forgets it.
  void stop();

  /// Whether it can be given a frame: the word on the one before was taken.
  bool is_free() const;
  /// Whether it is at work, or was at any time since; ns, monotonic.
  bool was_at_work_since(std::int64_t ns) const;
  /// The navigator's; from any thread.
  HealthReport health() const { return navigator_.health(); }
  /// Copies the image.
  void give(View2D<const u8> image, const FrameStamp& stamp, const std::optional<Expectation>& expected);
  /// Takes the word on the frame that was given, if it is there, or waiting for it. Throws what the look has thrown.
  bool take(Sighting& sighting, bool waiting);

 private:
  enum class State { free, given, done };

  void work();
  void warm_up();
  void set(State state);

  Navigator navigator_;
  GrayImage image_;
  FrameStamp stamp_;
  std::optional<Expectation> expected_;
  Sighting sighting_;
  std::exception_ptr error_;
  mutable std::mutex mutex_;
  std::condition_variable changed_;
  State state_ = State::free;
  std::int64_t done_ns_ = 0;
  bool ending_ = false;
  std::thread thread_;
};

}  // namespace berth
