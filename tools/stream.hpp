#pragma once

#include <cstdint>
#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "berth/source.hpp"
#include "console.hpp"
#include "engine.hpp"
#include "frame_observer.hpp"
#include "paced_play.hpp"

namespace berth::cli {

/// What becomes of a source's frames.
struct StreamOptions {
  EngineOptions engine;
  /// What opens its backends.
  std::function<EngineBackends(const EngineOptions&)> open_backends = open_chosen_backends;
  /// JSON lines, one a frame; "-" is standard output, and what a person reads then goes to standard error.
  std::string log;
  /// Trajectory drawing of the marker seen most often.
  std::string svg;
  /// Annotated PNG of the last of the frames with the most markers.
  std::string picture;
  bool digests = false;
  /// Poses filtered over time, beside the raw ones.
  bool filter = false;
  /// Markers are followed in windows; every so many frames are searched whole, 0 for the tracker's default.
  bool track = false;
  int full_every = 0;
  /// Of a replay, what was recorded through a pipeline: TrackerConfig::behind there. 0: nothing was.
  int behind = 0;
  /// 0 for all.
  std::uint64_t max_frames = 0;
  /// A known answer at start and every so many seconds, memory checked all the while; 0: neither.
  double known_answer_s = 0;
  /// A backend that was left is tried again after so many seconds; 0: never.
  double fail_back_s = 0;
  /// Through a pipeline: a device that a frame is waited for longer is left, ms; 0 waits for as long as it takes.
  double hang_ms = 0;
  /// In real time, through a pipeline.
  PaceOptions pace;
  /// They get every frame, whichever way it took.
  std::vector<std::shared_ptr<FrameObserver>> observers;
};

/// What a stream came to.
struct StreamSum {
  std::uint64_t frames = 0;
  std::uint64_t with_markers = 0;
  /// Frames in which two backends in lockstep disagreed.
  std::uint64_t differing = 0;
};

/// Detects in every frame until the source ends, max_frames is reached or SIGINT comes; then sums up, and with a
/// simulated source prints the errors against its truth. Families, camera and marker sizes come from the options, else
/// from what the source knows.
StreamSum run_stream(Source& source, const StreamOptions& options, Console& console);

}  // namespace berth::cli
