#pragma once

#include <string>
#include <vector>

#include "score_curve.hpp"

namespace berth::cli {

/// A method without a curve: decisions at some thresholds, the first and the last of them labelled.
struct MarkedSeries {
  std::string name;
  struct Mark {
    std::string label;
    Decisions decisions;
  };
  std::vector<Mark> marks;
};

/// A network's curve (score_curve), its name and the threshold it is used with, Q15; and others beside it.
struct RocPlot {
  std::string network;
  std::vector<CurvePoint> curve;
  int threshold_q15 = 16384;
  std::vector<MarkedSeries> others;
};

/// The drawing as SVG text, 600 px wide: true- over false-positive rate, the area under it in the legend.
std::string roc_svg(const RocPlot& plot);
/// The same of precision over recall, drawn in the steps whose area the legend gives.
std::string precision_recall_svg(const RocPlot& plot);

}  // namespace berth::cli
