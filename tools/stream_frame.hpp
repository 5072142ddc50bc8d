#pragma once

#include <string>
#include <vector>

#include "berth/image.hpp"
#include "berth/source.hpp"

namespace berth::cli {

/// A source's frame, whoever has its pixels: a SourceFrame of its own, or a pipeline's slot.
struct StreamFrame {
  const std::string& label;
  View2D<const u8> image;
  /// Empty where the source does not know it.
  const std::vector<TruthMarker>& truth;
  const std::vector<TruthTarget>& truth_targets;
};

inline StreamFrame stream_frame(const SourceFrame& frame) {
  return {frame.label, frame.image.view(), frame.truth, frame.truth_targets};
}

}  // namespace berth::cli
