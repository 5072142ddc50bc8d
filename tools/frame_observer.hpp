#pragma once

#include <cstdint>
#include <optional>
#include <ostream>
#include <string>
#include <vector>

#include "berth/camera.hpp"
#include "berth/detector.hpp"
#include "berth/frame.hpp"
#include "berth/health.hpp"
#include "berth/image.hpp"
#include "berth/pilot.hpp"
#include "berth/pipeline.hpp"
#include "berth/source.hpp"
#include "berth/tracker.hpp"

namespace berth::cli {

class MarkerFilters;

/// What a stream is, as far as it is known before its first frame comes out.
struct ObservedStream {
  /// Of the first frame; those of a folder may be of several sizes.
  int width = 0, height = 0;
  /// Of frames of that size.
  const DetectorConfig& config;
  /// "simd on NAME"
  const std::string& backend;
};

/// One finished frame. Everything in it is valid during the call only.
struct ObservedFrame {
  /// File name, or the source's own label.
  const std::string& label;
  /// As the source delivered it.
  View2D<const u8> image;
  /// Stamp, status, detections, poses, digests of the stages. Poses are in metres: where a simulated source tells the
  /// markers' sizes, by those.
  const FrameResult& result;
  /// digest_of what the engine found, before a simulated source's sizes scaled its poses.
  u64 digest = 0;
  /// What the engine was about: docking where there is no pilot.
  Mode mode = Mode::docking;
  /// For frames of this size; none where none is known.
  const std::optional<CameraModel>& camera;
  /// How the frame was searched, where markers are followed in windows; null otherwise.
  const TrackedFrame* tracked = nullptr;
  /// Its times, where it came through a pipeline; null otherwise.
  const PipelineFrame* paced = nullptr;
  /// Only simulated sources know; empty otherwise.
  const std::vector<TruthMarker>& truth;
  const std::vector<TruthTarget>& truth_targets;
  /// The backend that it was run on.
  const char* backend = "";
  /// Submitted until collected, by the wall clock, ns; 0 where it came through a pipeline.
  std::int64_t wall_ns = 0;
  /// What its camera has been through so far.
  SourceHealth health;
  /// How the engine is.
  HealthReport engine;
  /// The markers' tracks, this frame in them, where poses are filtered; null otherwise.
  const MarkerFilters* filters = nullptr;
  /// The pipeline's counts so far; null where there is none.
  const PipelineCounts* counts = nullptr;
};

/// Whoever wants to have every frame of `berth run`: StreamOptions::observers. All calls come from one thread, the
/// stream's, in the frames' order. A camera's frames are dropped while that thread is held up, so none may block: what
/// waits for a disk, a network or a person copies what it needs, in bounded memory, and works on a thread of its own.
class FrameObserver {
 public:
  virtual ~FrameObserver() = default;
  /// Once, before the first frame.
  virtual void begin(const ObservedStream&) {}
  /// Once for each frame that came out, whatever its status; frames that were dropped show in the stamps' numbers.
  virtual void observe(const ObservedFrame& frame) = 0;
  /// Once, after the last frame, unless the stream ended in an error: `people` is for a line on what was written where.
  /// Throws Error where something went wrong.
  virtual void finish(std::ostream& people) { (void)people; }
};

}  // namespace berth::cli
