#pragma once

#include <vector>

#include "frame/marker_plan.hpp"

namespace berth {

/// What a frame wrote, stage by stage, copied off the device: for digests and comparisons, not for the frame path.
class StageReader {
 public:
  /// The plan's last frame must be done.
  StageReader(MarkerPlan& plan, Stream& stream);

  /// The words of stage `index` that belong to the frame: lists end where they end, slots without a quadrilateral are
  /// reduced to their flags.
  const std::vector<u32>& read(std::size_t index);

 private:
  std::size_t fetch(Buffer& buffer, std::vector<u32>& words);

  MarkerPlan& plan_;
  Stream& stream_;
  struct Search {
    std::vector<u32> contours;
    std::vector<u32> quads;
  };
  std::vector<Search> searches_;
  std::vector<u32> words_;
};

}  // namespace berth
