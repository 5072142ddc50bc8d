#include "target_show.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace berth::cli {

std::string describe(const DiscTarget& target, const DiscPose& pose) {
  if (!pose.has_pose) return "target " + target.name + ": not found";
  const std::array<double, 3>& t = pose.pose.t;
  return fmt::format("target {}: xyz {:+.4f} {:+.4f} {:.4f} m from {} of {} discs", target.name, t[0], t[1], t[2],
                     pose.used, target.discs.size());
}

const TruthTarget* truth_of(const DiscTarget& target, const std::vector<TruthTarget>& truth) {
  const auto known =
      std::find_if(truth.begin(), truth.end(), [&](const TruthTarget& one) { return one.name == target.name; });
  return known == truth.end() ? nullptr : &*known;
}

bool any_found(const std::vector<DiscPose>& targets) {
  return std::any_of(targets.begin(), targets.end(), [](const DiscPose& target) { return target.has_pose; });
}

}  // namespace berth::cli
