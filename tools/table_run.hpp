#pragma once

#include <functional>
#include <string>
#include <vector>

#include "table/pose_error.hpp"
#include "table/stage.hpp"
#include "table_readers.hpp"

namespace berth::cli {

/// One frame of the table, as it was and as it was read.
struct TableFrame {
  double travel = 0;
  TruthMarker truth;
  /// The marker was wholly in view; frames where it was not count for nothing.
  bool shown = false;
  /// The bounds of its pose's axes, m and rad, and of its corners' RMS distance, px; none where it was not shown, or
  /// where the image does not tell.
  std::optional<table::SixAxes> bound;
  double corner_bound_px = 0;
  /// One of each method, in TableReaders' order.
  std::vector<std::optional<Reading>> readings;
};

/// One experiment with its frames.
struct TableSweep {
  table::Sweep sweep;
  std::vector<TableFrame> frames;

  table::SweepErrors errors(std::size_t method) const;
  /// Of the best estimator there could be that has one camera's frame alone.
  table::SweepBound bound() const;
};

/// Looks at every stop once. `progress` is called after each frame.
TableSweep run_sweep(const table::Sweep& sweep, const table::Stage& stage, u64 seed, TableReaders& readers,
                     const std::function<void()>& progress);

}  // namespace berth::cli
