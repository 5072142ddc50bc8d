#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "berth/detector.hpp"
#include "frame_json.hpp"
#include "frame_observer.hpp"

namespace berth::cli {

/// A frame's record read back, as far as people are shown it: frame_record's other way. What a record does not hold
/// (stages' capacities, the chi-squares behind an ambiguity) is not there.
class RecordedResult {
 public:
  /// `record`: frame_record of a run with that configuration; `camera`: of its frames; `name`: of the frame, for
  /// messages. Throws Error where it is none.
  RecordedResult(const Json& record, const DetectorConfig& config, const std::optional<CameraModel>& camera,
                 const std::string& backend, const std::string& name);
  RecordedResult(const RecordedResult&) = delete;
  RecordedResult& operator=(const RecordedResult&) = delete;

  /// As a stream would have handed it over, with this picture; valid as long as this is.
  ObservedFrame observed(View2D<const u8> image) const;
  /// Frames before this one that could not be recorded.
  std::uint64_t missed() const { return missed_; }

 private:
  void read(const Json& record, const DetectorConfig& config);

  FrameResult result_;
  std::string label_;
  Mode mode_ = Mode::docking;
  std::optional<CameraModel> camera_;
  std::string backend_;
  std::optional<TrackedFrame> tracked_;
  std::optional<PipelineFrame> paced_;
  std::vector<TruthMarker> truth_;
  std::vector<TruthTarget> truth_targets_;
  std::uint64_t missed_ = 0;
};

}  // namespace berth::cli
