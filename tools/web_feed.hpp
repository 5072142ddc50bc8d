#pragma once

#include <array>
#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "berth/frame.hpp"
#include "berth/pilot.hpp"
#include "berth/pipeline.hpp"
#include "berth/source.hpp"
#include "berth/tracker.hpp"
#include "web_samples.hpp"

namespace berth::cli {

/// What a page tells of a run apart from poses, as of the newest frame.
struct WebStatus {
  u64 frames = 0, with_pose = 0, overflows = 0, sequence = 0;
  /// When it was done and when it was taken, by the page's clock; the latter is the former where the camera's clock is
  /// not this machine's.
  double finished_s = 0, captured_s = 0;
  bool captured_known = false;
  /// Of the last second.
  double frames_per_second = 0;
  std::array<char, 96> label = {};
  FrameStatus status = FrameStatus::no_target;
  Mode mode = Mode::docking;
  bool is_tracked = false, is_whole = true;
  SearchReason why = SearchReason::none_held;
  const char* backend = "";
  bool is_paced = false;
  PipelineCounts counts;
  SourceHealth health;
  HealthReport engine;
};

/// One picture of the video with what is drawn on it, encoded once for all who watch.
struct WebPicture {
  u64 number = 0;
  std::string jpeg;
  /// JSON on one line: docs/live-view.md.
  std::string about;
};

/// What viewers read, and the stream's thread writes without ever waiting for them: where a reader holds the lock, what
/// there is to tell waits for the next frame, in bounded memory.
class WebFeed {
 public:
  /// Samples that are kept for viewers to come.
  static constexpr std::size_t kKept = 16384;

  WebFeed();

  /// Since the page's clock began.
  double now_s() const;

  /// By the stream's thread, for each frame; `samples` only now and then.
  void publish(const WebStatus& status, const std::vector<WebSample>& samples, const std::vector<WebObject>& objects);
  /// By the thread that encodes.
  void show(std::shared_ptr<const WebPicture> picture);
  /// Nothing comes after this.
  void end();
  /// Wakes all who wait: they are to go.
  void close();

  WebStatus status() const;
  bool has_ended() const { return ended_; }
  bool is_closed() const { return closed_; }
  std::vector<WebObject> objects(std::size_t from) const;
  /// The number that the next sample will have.
  u64 newest() const;
  /// Those from number `cursor` on, `most` of them at most; moves the cursor behind the last. One that is older than
  /// what is kept starts with the oldest.
  std::vector<WebSample> samples(u64& cursor, std::size_t most) const;
  /// The first picture after number `after`, waiting for it; null where none came.
  std::shared_ptr<const WebPicture> picture(u64 after, std::chrono::milliseconds wait) const;
  /// Sleeps, unless the run ends or the feed closes meanwhile.
  void sleep(std::chrono::milliseconds time) const;

  /// Samples that found no room while readers held the lock.
  u64 lost() const { return lost_; }

 private:
  const std::chrono::steady_clock::time_point began_ = std::chrono::steady_clock::now();

  mutable std::mutex mutex_;
  WebStatus status_;
  std::vector<WebObject> objects_;
  std::vector<WebSample> ring_;
  u64 written_ = 0;

  /// The stream's thread's own.
  std::vector<WebSample> waiting_;
  std::atomic<u64> lost_ = 0;

  mutable std::mutex picture_mutex_;
  mutable std::condition_variable changed_;
  std::shared_ptr<const WebPicture> picture_;
  std::atomic<bool> ended_ = false, closed_ = false;
};

}  // namespace berth::cli
