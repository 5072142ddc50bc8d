#include "frame_json.hpp"

#include <fmt/format.h>

namespace berth::cli {
namespace {

Json to_json(const Pose& pose) { return {{"R", pose.R}, {"t", pose.t}}; }

void add_uncertainty(const PoseUncertainty& uncertainty, Json& pose) {
  pose["covariance"] = uncertainty.covariance;
  pose["error_px"] = uncertainty.error_px;
  pose["ambiguity"] = uncertainty.ambiguity();
  if (uncertainty.has_other) {
    pose["other"] = to_json(uncertainty.other);
    pose["other"]["error_px"] = uncertainty.other_error_px;
  }
}

}  // namespace

Json to_json(const Detection& detection) {
  Json json = {{"family", detection.family->name}, {"id", detection.id},           {"hamming", detection.hamming},
               {"margin", detection.margin},       {"corners", detection.corners}, {"center", detection.center}};
  if (detection.corner_covariance_px2) json["corner_covariance_px2"] = *detection.corner_covariance_px2;
  if (detection.corner_fit) {
    json["corner_fit"] = {{"noise", detection.corner_fit->noise},
                          {"blur_px2", detection.corner_fit->blur_px2},
                          {"local_levels", detection.corner_fit->local_levels}};
  }
  if (detection.has_pose) json["pose"] = to_json(detection.pose);
  if (detection.pose_uncertainty) add_uncertainty(*detection.pose_uncertainty, json["pose"]);
  return json;
}

Json to_json(const std::vector<Detection>& detections) {
  Json json = Json::array();
  for (const Detection& detection : detections) json.push_back(to_json(detection));
  return json;
}

Json to_json(const std::vector<BundlePose>& poses, const std::vector<Bundle>& bundles) {
  Json json = Json::array();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const BundlePose& pose = poses[i];
    json.push_back({{"name", bundles[i].name},
                    {"used", pose.used},
                    {"kept_out", pose.kept_out},
                    {"corners_kept_out", pose.corners_kept_out}});
    if (!pose.has_pose) continue;
    json.back()["pose"] = to_json(pose.pose);
    add_uncertainty(pose.uncertainty, json.back()["pose"]);
  }
  return json;
}

Json to_json(const std::vector<DiscPose>& poses, const std::vector<DiscTarget>& targets) {
  Json json = Json::array();
  for (std::size_t i = 0; i < poses.size(); ++i) {
    const DiscPose& pose = poses[i];
    json.push_back({{"name", targets[i].name}, {"used", pose.used}});
    if (!pose.has_pose) continue;
    json.back()["pose"] = to_json(pose.pose);
    add_uncertainty(pose.uncertainty, json.back()["pose"]);
    for (std::size_t k = 0; k < targets[i].discs.size(); ++k) {
      const DiscSight& disc = pose.discs[k];
      json.back()["discs"].push_back(
          disc.seen ? Json({{"center", disc.center_px}, {"covariance_px2", disc.covariance_px2}}) : Json());
    }
  }
  return json;
}

Json to_json(const TruthTarget& target) { return {{"name", target.name}, {"pose", to_json(target.pose)}}; }

Json to_json(const TruthMarker& marker) {
  return {{"family", marker.family},   {"id", marker.id},           {"size", marker.size_m},
          {"visible", marker.visible}, {"corners", marker.corners}, {"pose", to_json(marker.pose)}};
}

Json to_json(const FrameResult& frame, const std::string& label, std::int64_t cpu_ns,
             const std::vector<TruthMarker>& truth) {
  Json times = Json::object();
  for (const StageTime& time : frame.times) {
    if (time.stage[0] != '\0') times[time.stage] = static_cast<double>(time.ns) / 1e3;
  }
  Json json = {{"frame", frame.stamp.sequence},
               {"label", label},
               {"clock", frame.stamp.clock},
               {"mid_exposure_ns", frame.stamp.mid_exposure_ns},
               {"status", name_of(frame.status)},
               {"ms", ms_of(cpu_ns)},
               {"stages_us", times},
               {"quads", frame.quads},
               {"detections", to_json(frame.detections)}};
  if (frame.status == FrameStatus::overflow) {
    for (const CapacityUse& use : frame.capacities) {
      json["capacities"][use.what] = {{"needed", use.needed}, {"capacity", use.capacity}};
    }
  }
  if (!truth.empty()) {
    for (const TruthMarker& marker : truth) json["truth"].push_back(to_json(marker));
  }
  for (const StageDigest& digest : frame.digests) json["digests"][digest.stage] = fmt::format("{:016x}", digest.digest);
  return json;
}

Json to_json(const TrackedFrame& tracked) {
  Json windows = Json::array();
  for (const SearchWindow& window : tracked.windows) {
    windows.push_back({{"x", window.x}, {"y", window.y}, {"side", window.side}});
  }
  return {{"whole", tracked.whole}, {"why", name_of(tracked.why)}, {"windows", windows}, {"held", tracked.held}};
}

std::string to_line(const Json& json) { return json.dump(-1, ' ', false, Json::error_handler_t::replace); }

}  // namespace berth::cli
