#include "bundle_show.hpp"

#include <fmt/format.h>

#include "pose_algebra.hpp"

namespace berth::cli {

std::string describe(const std::string& name, const BundlePose& pose) {
  std::string text = "bundle " + name + ": ";
  if (pose.has_pose) {
    const std::array<double, 3>& t = pose.pose.t;
    text += fmt::format("xyz {:+.4f} {:+.4f} {:+.4f} m from {} marker{}", t[0], t[1], t[2], pose.used,
                        pose.used == 1 ? "" : "s");
  } else {
    text += "no pose";
  }
  if (pose.kept_out > 0) text += fmt::format(", {} kept out", pose.kept_out);
  if (pose.corners_kept_out > 0) {
    text += fmt::format(", {} corner{} kept out", pose.corners_kept_out, pose.corners_kept_out == 1 ? "" : "s");
  }
  return text;
}

bool truth_of(const Bundle& bundle, const std::vector<TruthMarker>& truth, Pose& pose) {
  for (const TruthMarker& known : truth) {
    const BundleMarker* marker = bundle.find(family(known.family), known.id);
    if (marker == nullptr) continue;
    pose = compose(known.pose, inverse(marker->pose));
    return true;
  }
  return false;
}

}  // namespace berth::cli
