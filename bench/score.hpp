#pragma once

#include <vector>

#include "berth/source.hpp"
#include "engines.hpp"

namespace berth::bench {

/// Counts of one engine over a corpus.
struct Score {
  int required = 0;  // markers fully visible
  int recalled = 0;
  int extra = 0;  // partly visible ones found: neither asked for nor wrong
  int false_positives = 0;
  double square_error = 0;  // of the recalled markers' corners, px^2
  int corners = 0;

  double recall() const { return required == 0 ? 1 : static_cast<double>(recalled) / required; }
  double corner_rms_px() const;
  /// Adds one frame. A detection is a true marker's when the id is its and every corner is nearer than a quarter of the
  /// side (at least 2 px) to its true place.
  void add(const std::vector<TruthMarker>& truth, const std::vector<Found>& found);
};

}  // namespace berth::bench
