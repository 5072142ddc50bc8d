#pragma once

#include <string>
#include <vector>

#include "berth/bundle.hpp"
#include "berth/source.hpp"

namespace berth::cli {

/// One line for a person: "bundle NAME: xyz … m from 4 markers, 1 kept out", or that it has no pose.
std::string describe(const std::string& name, const BundlePose& pose);

/// The bundle's true pose, from the first of its markers that the simulator knows of; false where it knows none.
bool truth_of(const Bundle& bundle, const std::vector<TruthMarker>& truth, Pose& pose);

}  // namespace berth::cli
