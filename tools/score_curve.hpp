#pragma once

#include <optional>
#include <vector>

#include "decisions.hpp"

namespace berth::cli {

/// An image's score, Q15, and whether the target is there.
struct Scored {
  int score_q15 = 0;
  bool present = false;
};

/// What is decided when a score of `threshold_q15` or more means found.
struct CurvePoint {
  int threshold_q15 = 0;
  Decisions decisions;
};

/// The points of the receiver operating characteristic and of precision over recall: the first above every score, where
/// nothing is found, then one for each score that occurs, falling; images of equal score are found together.
std::vector<CurvePoint> score_curve(std::vector<Scored> images);

/// Area under true-positive over false-positive rate, straight between the points: the chance that an image with the
/// target scores higher than one without, equal scores half. None where one of both kinds is missing.
std::optional<double> roc_area(const std::vector<CurvePoint>& curve);

/// Area under precision over recall in steps, each recall gained at the precision it was reached with (average
/// precision): straight lines between the points would promise more than any threshold gives (Davis & Goadrich 2006).
/// None where no image has the target.
std::optional<double> average_precision(const std::vector<CurvePoint>& curve);

}  // namespace berth::cli
