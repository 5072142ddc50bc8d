#pragma once

#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <mutex>
#include <optional>
#include <string>
#include <vector>

#include "berth/source.hpp"
#include "frame_json.hpp"
#include "frame_observer.hpp"

namespace berth::cli {

/// A finished frame as it waits to be written: copies of all that an ObservedFrame borrows.
struct QueuedFrame {
  std::string label;
  FrameResult result;
  u64 digest = 0;
  Mode mode = Mode::docking;
  std::optional<CameraModel> camera;
  bool is_tracked = false, is_paced = false;
  TrackedFrame tracked;
  PipelineFrame paced;
  std::vector<TruthMarker> truth;
  std::vector<TruthTarget> truth_targets;
  const char* backend = "";
  std::int64_t wall_ns = 0;
  SourceHealth health;
  HealthReport engine;
  /// When it was handed over: nanoseconds since 1970.
  std::int64_t came_ns = 0;
  /// Filtered poses, where there is a filter.
  Json filtered;
  /// Its picture in FrameQueue::picture; -1 where there was no room for it.
  int picture = -1;
  /// Frames that there was no room for since the one before this.
  std::uint64_t missed_frames = 0;

  /// Of this, to be looked at as any other.
  ObservedFrame observed(View2D<const u8> image) const;
};

/// Finished frames on their way from the stream's thread to the recorder's: bounded, pictures apart from the rest,
/// since they are what takes memory. All of it is taken when it is made; a longer list of markers than ever before,
/// digests, another picture's size and filtered poses take more.
class FrameQueue {
 public:
  /// Room for so many pictures, and for four times as many frames without one. No `pictures`: none is taken.
  FrameQueue(std::size_t frames, bool pictures, int width, int height);

  /// Takes a copy. Where there is no room, `wait` waits for it; otherwise the picture, or all of the frame, is left out
  /// and counted. One thread.
  void push(const ObservedFrame& frame, std::int64_t came_ns, bool wait);
  /// No more frames come.
  void close();

  /// The oldest frame, until the next call; null once the queue is closed and empty, or, with a time, when that has
  /// passed without one (`closed` tells). One thread.
  const QueuedFrame* next(std::chrono::milliseconds patience, bool& closed);
  View2D<const u8> picture(const QueuedFrame& frame) const;

  std::uint64_t dropped_frames() const;
  /// Of frames that were taken without.
  std::uint64_t dropped_pictures() const;

 private:
  bool pictures_;
  std::vector<QueuedFrame> frames_;
  std::vector<GrayImage> images_;

  mutable std::mutex mutex_;
  std::condition_variable came_, went_;
  std::vector<int> free_images_;
  std::size_t first_ = 0, count_ = 0;  // of frames_, a ring
  bool given_ = false;                 // the first is with the reader
  bool closed_ = false;
  std::uint64_t missed_ = 0, dropped_frames_ = 0, dropped_pictures_ = 0;
};

}  // namespace berth::cli
