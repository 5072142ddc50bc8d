#pragma once

#include "survey/net.hpp"

namespace berth {

/// Where the markers and cameras of a net are, roughly, from its sights alone: along a tree of pairs of markers that
/// frames show together, each pair placed so that most frames agree. Either pose of a plane (docs/pose.md) is tried.
/// With `free_sizes` sizes up to a half larger, or a third smaller, than the net's are tried, but the origin's. All
/// markers must be connected. Cameras whose frame gives none keep what they had, and their sights are dropped.
void start_net(SurveyNet& net, bool free_sizes);

}  // namespace berth
