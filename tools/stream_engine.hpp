#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "berth/pipeline.hpp"
#include "berth/source.hpp"
#include "console.hpp"
#include "engine.hpp"
#include "stream.hpp"
#include "stream_frame.hpp"

namespace berth::cli {

/// How a stream follows markers; none where it does not.
std::optional<TrackerConfig> tracking_of(const StreamOptions& options);

/// The engine of a stream, with what its options and its source say. Made for the first frame, since a simulated one
/// tells families and sizes that were not given.
class StreamEngine {
 public:
  /// `like`: the first frame; of a camera's that has not come the size. Notes why there are no poses. Throws Error as
  /// make_config and Engine do.
  StreamEngine(const StreamOptions& options, const Source& source, const SourceFrame& like, Console& console);

  Engine& engine() { return *engine_; }
  const Engine& engine() const { return *engine_; }
  /// What a pipeline on the engine's backends is made with, for frames of this size.
  PipelineConfig pipeline_config(int width, int height) const;

  /// The camera file's, or what --camera-fit makes of it.
  std::optional<CameraModel> camera_of(const StreamFrame& frame) const {
    return engine_->camera_for(frame.image.width, frame.image.height);
  }
  /// The side of a detection's marker, m: its bundle's, the truth's or the options'.
  double size_of(const Detection& detection, const std::vector<TruthMarker>& truth) const;
  /// Poses in metres, where the truth tells the markers' sizes; those of which no size is known are taken away.
  void scale_poses(std::vector<Detection>& detections, const std::vector<TruthMarker>& truth) const;

 private:
  std::optional<HealthConfig> health() const;
  bool in_bundle(const Detection& detection) const;

  const StreamOptions& options_;
  std::function<std::unique_ptr<Backend>(std::size_t)> reopen_;
  bool size_given_ = false;
  std::optional<Engine> engine_;
};

}  // namespace berth::cli
