#include "marker_filters.hpp"

#include "engine.hpp"
#include "truth_score.hpp"

namespace berth::cli {
namespace {

PoseFilterConfig config_for(const CameraModel& camera, double size_m) {
  PoseFilterConfig filter;
  filter.camera = camera;
  filter.marker_size_m = size_m;
  return filter;
}

}  // namespace

void MarkerFilters::update(const FrameResult& frame, const DetectorConfig& config,
                           const std::optional<CameraModel>& camera, const std::vector<TruthMarker>& truth) {
  for (const Detection& detection : frame.detections) {
    const std::pair<std::string, int> key = {detection.family->name, detection.id};
    if (!camera || !detection.has_pose || tracks_.count(key) != 0 || tracks_.size() == kMost) continue;
    const TruthMarker* marker = truth_of(detection, truth);
    const double size_m = marker != nullptr ? marker->size_m : marker_size_m(config, *detection.family, detection.id);
    tracks_.emplace(key, Track{PoseFilter(config_for(*camera, size_m)), detection.family, {}, size_m});
  }
  poses_.clear();
  for (auto& [key, track] : tracks_) {
    const Detection* seen = nullptr;
    for (const Detection& detection : frame.detections) {
      const bool is_it = detection.id == key.second && detection.family == track.family && detection.has_pose;
      if (is_it && seen == nullptr) seen = &detection;
    }
    track.pose = track.filter.update(frame.stamp.mid_exposure_ns, seen);
    if (!track.pose.has_pose || seen == nullptr) continue;
    poses_.push_back(*seen);
    poses_.back().pose = track.pose.pose;
  }
}

void MarkerFilters::foretell(std::int64_t time_ns, const std::optional<CameraModel>& camera, Tracker& tracker) const {
  if (!camera) return;
  for (const auto& [key, track] : tracks_) {
    tracker.expect(*track.family, key.second, *camera, track.size_m, track.filter.foretell(time_ns));
  }
}

const FilteredPose* MarkerFilters::find(const std::string& family, int id) const {
  const auto track = tracks_.find({family, id});
  return track != tracks_.end() && track->second.pose.has_pose ? &track->second.pose : nullptr;
}

Json MarkerFilters::to_json() const {
  Json json = Json::array();
  for (const auto& [key, track] : tracks_) {
    const FilteredPose& p = track.pose;
    if (!p.has_pose) continue;
    json.push_back({{"family", key.first},
                    {"id", key.second},
                    {"measured", p.measured},
                    {"outlier", p.outlier},
                    {"sure", p.sure},
                    {"jumped", p.jumped},
                    {"age_s", p.age_s},
                    {"R", p.pose.R},
                    {"t", p.pose.t},
                    {"covariance", p.covariance},
                    {"velocity", p.velocity},
                    {"velocity_covariance", p.velocity_covariance}});
  }
  return json;
}

}  // namespace berth::cli
