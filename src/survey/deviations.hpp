#pragma once

#include "survey/net.hpp"
#include "survey/survey.hpp"

namespace berth {

/// Sets the markers' deviations and the survey's correlation, from a settled net whose kept corners' squares, in
/// standard deviations, sum to `squares`. The survey's frames are counted. Returns false, and sets none, where the
/// corners do not determine every marker.
bool set_deviations(const SurveyNet& net, bool free_sizes, double squares, Survey& result);

}  // namespace berth
