#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "berth/pipeline.hpp"
#include "frame/detector_parts.hpp"
#include "pipeline/returned_frames.hpp"

namespace berth {

/// One slot: a frame on each backend, of which one has the pixels, and its result. It is touched without a lock, by the
/// one thread whose it is at the time (SlotRing).
struct PipelineSlot {
  std::vector<std::unique_ptr<DeviceFrame>> devices;
  /// Which backends, opened anew, they are of; null for those that the pipeline was made with.
  std::vector<const ReturnedFrames*> origins;
  std::size_t on = 0;
  /// False where enqueueing has thrown: there is nothing to wait for then.
  bool submitted = false;
  FrameResult result;
  /// With a tracker: where it is to be searched, and where it was.
  SearchOrder order;
  TrackedFrame tracked;
  std::int64_t arrived_ns = 0, taken_ns = 0, submitted_ns = 0, done_ns = 0;
  PipelineFrame frame;

  DeviceFrame& device() { return *devices[on]; }
};

/// All slots of a pipeline, with frames on every backend and room for the windows of a tracker; that for results is the
/// decoders' to reserve. Their place does not change any more: they point to their own parts. Throws Error as Detector,
/// and without a backend.
std::vector<PipelineSlot> make_slots(const std::vector<Backend*>& backends, int width, int height,
                                     const PipelineConfig& config);

/// What the slots have taken, once there is room for results.
PipelineMemory memory_of(const std::vector<PipelineSlot>& slots);

}  // namespace berth
