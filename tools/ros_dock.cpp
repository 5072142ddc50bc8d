#include "ros_dock.hpp"

#include <algorithm>
#include <cstdlib>

#include "berth/error.hpp"

namespace berth::cli {
namespace {

template <class Things>
std::size_t index_of(const Things& things, const std::string& name) {
  const auto at = std::find_if(things.begin(), things.end(), [&](const auto& thing) { return thing.name == name; });
  return static_cast<std::size_t>(at - things.begin());
}

}  // namespace

RosDock::RosDock(const std::string& name, const DetectorConfig& config) {
  if (name.empty()) {
    if (!config.bundles.empty()) {
      kind_ = Kind::bundle;
    } else if (!config.disc_targets.empty()) {
      kind_ = Kind::target;
    }
    return;
  }
  index_ = index_of(config.bundles, name);
  if (index_ < config.bundles.size()) {
    kind_ = Kind::bundle;
    return;
  }
  index_ = index_of(config.disc_targets, name);
  if (index_ < config.disc_targets.size()) {
    kind_ = Kind::target;
    return;
  }
  const std::size_t colon = name.rfind(':');
  const std::string family_name = name.substr(0, colon);
  const std::string number = colon == std::string::npos ? "" : name.substr(colon + 1);
  char* end = nullptr;
  const long id = std::strtol(number.c_str(), &end, 10);
  const auto known = std::find(config.families.begin(), config.families.end(), family_name);
  if (known == config.families.end() || number.empty() || *end != '\0' || id < 0 ||
      static_cast<unsigned long>(id) >= family(family_name).codes.size()) {
    std::string things;
    for (const Bundle& bundle : config.bundles) things += ", bundle " + bundle.name;
    for (const DiscTarget& target : config.disc_targets) things += ", target " + target.name;
    for (const std::string& looked_for : config.families) {
      const std::string last = std::to_string(family(looked_for).codes.size() - 1);
      things.append(", ").append(looked_for).append(":0 to ").append(looked_for).append(":").append(last);
    }
    throw Error("--ros-dock " + name + ": nothing of that name is looked for; give one of " +
                (things.empty() ? "none" : things.substr(2)));
  }
  kind_ = Kind::marker;
  family_ = &family(family_name);
  id_ = static_cast<int>(id);
}

RosDock::Seen RosDock::in(const FrameResult& result) {
  if (kind_ == Kind::bundle) {
    const BundlePose& pose = result.bundles[index_];
    return pose.has_pose ? Seen{&pose.pose, &pose.uncertainty.covariance} : Seen();
  }
  if (kind_ == Kind::target) {
    const DiscPose& pose = result.disc_targets[index_];
    return pose.has_pose ? Seen{&pose.pose, &pose.uncertainty.covariance} : Seen();
  }
  for (const Detection& detection : result.detections) {
    if (!detection.has_pose) continue;
    if (kind_ == Kind::any_marker) {
      kind_ = Kind::marker;
      family_ = detection.family;
      id_ = detection.id;
    }
    if (detection.family != family_ || detection.id != id_) continue;
    return {&detection.pose, detection.pose_uncertainty ? &detection.pose_uncertainty->covariance : nullptr};
  }
  return {};
}

}  // namespace berth::cli
