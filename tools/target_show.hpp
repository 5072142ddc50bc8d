#pragma once

#include <string>
#include <vector>

#include "berth/disc_target.hpp"
#include "berth/source.hpp"

namespace berth::cli {

/// One line for a person: "target NAME: xyz … m from 5 of 5 discs", or that it was not found.
std::string describe(const DiscTarget& target, const DiscPose& pose);

/// The target of that name as it truly is; null where the simulator shows none.
const TruthTarget* truth_of(const DiscTarget& target, const std::vector<TruthTarget>& truth);

/// Whether any of them was found.
bool any_found(const std::vector<DiscPose>& targets);

}  // namespace berth::cli
