#pragma once

#include <atomic>
#include <cstdint>
#include <functional>
#include <thread>

#include "berth/frame.hpp"

namespace berth::cli {

/// Stands for a camera: a thread that hands on a frame whenever one is due. A frame's camera time is when it was due,
/// so that a camera held up by a busy machine shows as latency.
class PacedCamera {
 public:
  /// Hands on frame i, from 0 on; false ends the play.
  using Push = std::function<bool(std::uint64_t i, const FrameStamp& stamp)>;

  /// `realtime`: SCHED_FIFO priority of its thread, 0 for none.
  PacedCamera(double fps, std::uint64_t frames, int realtime) : fps_(fps), frames_(frames), realtime_(realtime) {}
  ~PacedCamera() {
    end();
    join();
  }
  PacedCamera(const PacedCamera&) = delete;
  PacedCamera& operator=(const PacedCamera&) = delete;

  /// Once; `at_end` is called on the thread after the last frame. Throws Error where the priority cannot be had.
  void start(Push push, std::function<void()> at_end);
  /// Ends the play early.
  void end() { ended_ = true; }
  void join() {
    if (thread_.joinable()) thread_.join();
  }
  /// Frames handed on more than a frame's time after they were due.
  std::uint64_t late() const { return late_; }

 private:
  void play(const Push& push);

  const double fps_;
  const std::uint64_t frames_;
  const int realtime_;
  std::atomic<bool> ended_ = false;
  std::atomic<std::uint64_t> late_ = 0;
  std::thread thread_;
};

}  // namespace berth::cli
