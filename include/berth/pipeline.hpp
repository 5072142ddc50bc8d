#pragma once

#include <array>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <vector>

#include "berth/detector.hpp"
#include "berth/health.hpp"
#include "berth/latency.hpp"
#include "berth/tracker.hpp"

namespace berth {

/// What becomes of a frame for which there is no room.
enum class Overrun {
  /// The newest frame wins: it takes the place of the one that waits, which is counted as dropped.
  newest,
  /// The camera's thread waits until there is room: no frame is lost. For files, not for cameras.
  wait,
};

struct PipelineConfig {
  DetectorConfig detector;
  /// Markers that are held are searched in windows (docs/tracking.md); the detector's window_sides are then the
  /// tracker's. A frame's windows go by the result TrackerConfig::behind frames before it, for which the device waits:
  /// with 1 nothing overlaps but receiving, with 2 device and host do. At most slots − 1.
  std::optional<TrackerConfig> tracking;
  /// Frames that there is memory for: one is filled or waits, the others are on the device, the host or with the
  /// reader. 2 or more; from 4 on receiving, device and host overlap in full.
  int slots = 4;
  Overrun overrun = Overrun::newest;
  /// A frame whose latency exceeds one of these counts as late for it, ns.
  std::array<std::int64_t, 2> deadlines_ns = {14'300'000, 33'000'000};
  /// The cores that the device's and the host's thread keep to, one each or one for both; empty for any.
  std::vector<int> cores;
  /// SCHED_FIFO priority of both threads, 1 to 99; 0 for the usual scheduling.
  int realtime_priority = 0;
  /// With it the host's thread checks memory before each frame, and now and then runs the picture whose answer is known
  /// in a frame's place on its slot, before that frame's result goes out: what a backend that fails made of it, nobody
  /// gets, and it is run again on the next. Meanwhile frames wait, or are dropped and counted.
  std::optional<HealthConfig> health;
  /// A device that a frame is waited for longer than this is left as one that is lost, ns; 0 waits for as long as it
  /// takes. Longer than the slowest frame by far: drivers may compile at a first one. For backends with a device.
  std::int64_t hang_ns = 0;
};

/// The parts of a frame's way, timed.
enum class Lap {
  wait,     ///< received until taken to the device
  device,   ///< upload to download
  queue,    ///< done on the device until the host takes it up; within `device` where the host must ask for that
  decode,   ///< codes, duplicates
  corners,  ///< the photometric fit, where it was asked for
  pose,     ///< with targets of discs, those too
  latency,  ///< camera time (mid-exposure) to pose; from the frame's arrival where its clock is not "monotonic"
};
constexpr std::size_t kLaps = 7;
const char* name_of(Lap lap);

/// What the frame that was dropped was waiting for.
enum class DropCause {
  device,  ///< the device was busy with an earlier frame
  host,    ///< every slot was taken, the oldest by decoding and poses
  reader,  ///< every slot was taken, the oldest by a callback at work or a result that nobody fetched
};
constexpr std::size_t kDropCauses = 3;
const char* name_of(DropCause cause);

/// A frame that went through. Valid until its callback returns, or until the next poll or next.
struct PipelineFrame {
  const FrameResult* result = nullptr;
  View2D<const u8> image;
  /// How it was searched, where there is tracking; null otherwise.
  const TrackedFrame* tracked = nullptr;
  /// The slot it was filled into: see FrameSlot.
  int slot = 0;
  /// Which of the pipeline's backends it was run on last.
  std::size_t backend = 0;
  /// By Lap, ns.
  std::array<std::int64_t, kLaps> laps_ns = {};
};

/// Where the camera's thread writes a frame.
struct FrameSlot {
  /// Rows may be further apart than they are long; null when the pipeline takes no frames.
  View2D<u8> image;
  /// 0 to slots − 1: for whoever keeps something of his own beside each frame.
  int slot = 0;
};

/// Counted since start. Once stopped, offered = delivered + all that were dropped.
struct PipelineCounts {
  u64 offered = 0;
  u64 delivered = 0;
  std::array<u64, kDropCauses> dropped = {};
  /// Delivered, of these: run again on the next backend; lost with the last one.
  u64 run_again = 0, device_lost = 0;
  /// Delivered later than each deadline.
  std::array<u64, 2> late = {};

  u64 all_dropped() const { return dropped[0] + dropped[1] + dropped[2]; }
};

/// All of it taken when the pipeline is made.
struct PipelineMemory {
  int slots = 0;
  std::size_t frame_bytes = 0;
  /// Buffers of all slots on all backends; host memory on CPU backends.
  std::size_t device_bytes = 0;
  /// What the host keeps for the slots: staging, downloads, results. Beside it one decoder's tables.
  std::size_t host_bytes = 0;
};

/// Frames that arrive at their own pace become results, in order: while one is on the host, the next is on the device
/// and another is received (docs/pipeline.md). Two threads of its own, one for the device and one for the host; no lock
/// is held longer than a queue takes, and between start and stop neither thread allocates (digests do). What a frame
/// comes to is what a Detector makes of it, whatever the slots, threads and times.
class Pipeline {
 public:
  /// Called on the host's thread, frame by frame. What it throws ends the pipeline and comes out of stop. It may call
  /// close() to end the pipeline, but neither stop() nor the destructor, which wait for that very thread.
  using Deliver = std::function<void(const PipelineFrame&)>;

  /// The backends in order of preference, as for FailoverDetector; they outlive this object. Without `deliver`, results
  /// are fetched by poll or next. Throws Error as Detector does, and on a configuration out of bounds.
  Pipeline(const std::vector<Backend*>& backends, int width, int height, const PipelineConfig& config,
           Deliver deliver = {});
  /// Stops; swallows what stop would throw. Never from a callback.
  ~Pipeline();
  Pipeline(const Pipeline&) = delete;
  Pipeline& operator=(const Pipeline&) = delete;

  /// Starts the threads and counts from 0. Throws Error where a core or the priority cannot be had; may be called again
  /// after stop.
  void start();
  /// Takes no more frames, brings those under way to their end and joins the threads; results that nobody fetched are
  /// dropped. Throws what a callback or, on the pipeline's own threads, a backend has thrown first, which dropped what
  /// was under way; Error when called from a callback.
  void stop();
  /// Takes no more frames: what is under way is still delivered, then next() ends. From any thread, callbacks too.
  void close();

  /// Copies a frame in; one thread at a time. False when it was not taken, and stands in no count: before start, after
  /// close, stop or an error. Throws Error on another size than the pipeline's.
  bool push(View2D<const u8> image, const FrameStamp& stamp);
  /// The same without a copy: a slot to write the pixels to, then commit. The frame that waits may be dropped for it.
  FrameSlot begin();
  bool commit(const FrameStamp& stamp);

  /// The oldest result not fetched yet, or null; one thread at a time. Only without a callback.
  const PipelineFrame* poll();
  /// The same, waiting for it; null once the pipeline is closed, or not started yet, and all is fetched.
  const PipelineFrame* next();

  /// At any time, from any thread.
  PipelineCounts counts() const;
  const LatencyHistogram& times(Lap lap) const;
  PipelineMemory memory() const;
  HealthReport health() const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace berth
