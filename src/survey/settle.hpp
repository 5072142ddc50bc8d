#pragma once

#include "survey/net.hpp"

namespace berth {

/// From a start to the adjusted net: robustly at first, then by least squares without the corners that do not fit,
/// until those stay the same. Returns false where there is no solution.
bool settle(SurveyNet& net, bool free_sizes);

}  // namespace berth
