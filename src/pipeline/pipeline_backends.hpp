#pragma once

#include <atomic>
#include <cstddef>
#include <memory>
#include <vector>

#include "berth/pipeline.hpp"
#include "health/health_watch.hpp"
#include "pipeline/device_waiter.hpp"
#include "pipeline/pipeline_slot.hpp"
#include "pipeline/returned_frames.hpp"

namespace berth {

/// The backends of a pipeline in order of preference, with the decoders that go with them: frames are run on the first
/// that can be believed. One that is lost, hangs or answers wrongly is left for the next, and gone back to once it has
/// been opened anew and has proven itself (docs/reliability.md). The host's thread, which sees all of that, calls what
/// is not said to be another's. Nothing here allocates once it is made.
class PipelineBackends {
 public:
  /// Reserves the results of all slots and, where health is watched, asks each of them on each backend what is known.
  /// All three outlive this object, and the watch the slots, whose frames may come to be on backends that were opened
  /// for it. Throws Error as Detector.
  PipelineBackends(const PipelineConfig& config, HealthWatch& watch, std::vector<PipelineSlot>& slots);
  /// Waits for a backend that is being opened, and for devices that hang.
  ~PipelineBackends();
  PipelineBackends(const PipelineBackends&) = delete;
  PipelineBackends& operator=(const PipelineBackends&) = delete;

  /// The camera's thread: has a slot lie, to be filled, on the backend that frames are run on.
  void place(PipelineSlot& slot);
  /// The device's thread: brings a slot's pixels to that backend where they are on another.
  void carry_over(PipelineSlot& slot);

  /// Waits for a slot's frame. False where it is to be run again, or has_failed(): its backend was left, now or before.
  bool await(PipelineSlot& slot);
  /// No backend is left that can be believed.
  bool has_failed() const { return watch_.has_failed(); }
  /// Makes the result of a frame that came.
  void finish(PipelineSlot& slot) { host_on(slot.on).finish(slot.device(), slot.result); }
  /// Asks the backend what is known where that is due, or it has just taken over; the slot's frame stays. False where
  /// the answer was wrong: the slot's result is not to be believed.
  bool is_believed(PipelineSlot& slot);
  /// Looks through the next slice of memory. Between two frames.
  void check_memory() { watch_.scrub(); }
  /// Has a backend take over again that has proven itself. Between two frames.
  void go_back();

  /// Host memory beside the slots' and the decoders' tables.
  std::size_t host_bytes() const { return kept_pixels_.size(); }

 private:
  void make_hosts();
  void reserve_results();
  void begin_watch();
  bool ask(PipelineSlot& slot, std::size_t backend, std::size_t from, std::size_t to);
  bool finish_on(std::size_t backend, DeviceFrame& device);
  std::size_t active() const;
  bool is_current(const PipelineSlot& slot, std::size_t backend) const;
  ReturnedFrames* renew(PipelineSlot& slot, std::size_t backend);
  HostFinish& host_on(std::size_t backend);

  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  const PipelineConfig& config_;
  HealthWatch& watch_;
  std::vector<PipelineSlot>& slots_;
  std::vector<std::unique_ptr<HostFinish>> hosts_;
  DeviceWaiters waiters_;
  /// By backend: the last that took over again, null before. The host's thread writes, those that have slots read.
  std::vector<std::atomic<ReturnedFrames*>> returned_;
  /// Of the known picture: its result, and what it was run over; and which backend was asked last.
  FrameResult known_result_;
  std::vector<u8> kept_pixels_;
  std::size_t asked_ = 0;
};

}  // namespace berth
