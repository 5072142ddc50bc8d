#pragma once

#include <optional>
#include <vector>

#include "berth/lockstep.hpp"
#include "frame/marker_plan.hpp"

namespace berth {

/// What a frame wrote, stage by stage, copied off the device: for digests and comparisons, not for the frame path.
class StageReader {
 public:
  /// The plan's last frame must be done; `full_resolution_only`: of full_resolution_plan().
  StageReader(MarkerPlan& plan, Stream& stream, bool full_resolution_only = false);

  /// How many stages the frame has been through.
  std::size_t stages() const { return stages_; }

  /// The words of stage `index` that belong to the frame: lists end where they end, slots without a quadrilateral are
  /// reduced to their flags.
  const std::vector<u32>& read(std::size_t index);

  const MarkerPlan& plan() const { return plan_; }

 private:
  std::size_t fetch(Buffer& buffer, std::vector<u32>& words);

  MarkerPlan& plan_;
  Stream& stream_;
  std::size_t stages_ = 0;
  struct Search {
    std::vector<u32> contours;
    std::vector<u32> quads;
  };
  std::vector<Search> searches_;
  std::vector<u32> words_;
};

/// The first word that differs, stages in order of computation, between two plans of one geometry and configuration.
std::optional<StageDifference> first_difference(StageReader& first, StageReader& second);
/// The same of two detectors' last frames; both must be collected.
std::optional<StageDifference> first_difference(Detector& first, Detector& second);

}  // namespace berth
