#pragma once

#include <map>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "berth/detector.hpp"
#include "berth/pose_filter.hpp"
#include "berth/source.hpp"
#include "berth/tracker.hpp"
#include "frame_json.hpp"

namespace berth::cli {

/// A pose filter for each marker of a stream.
class MarkerFilters {
 public:
  /// Markers beyond so many are not filtered.
  static constexpr std::size_t kMost = 64;

  /// Takes a frame: detections with poses of markers whose size is their bundle's or the configuration's, or the
  /// truth's where it has one. `camera`: the frame's, which may be another than the configuration's; none: no poses.
  void update(const FrameResult& frame, const DetectorConfig& config, const std::optional<CameraModel>& camera,
              const std::vector<TruthMarker>& truth);

  /// Tells a tracker where the markers will be in its frame of that time, seen by that camera.
  void foretell(std::int64_t time_ns, const std::optional<CameraModel>& camera, Tracker& tracker) const;

  /// The marker's track; null where it has none.
  const FilteredPose* find(const std::string& family, int id) const;
  /// Every marker with a track: family, id, pose, velocity and what is known of them.
  Json to_json() const;
  /// As detections, to be compared with truth.
  const std::vector<Detection>& as_detections() const { return poses_; }

 private:
  struct Track {
    PoseFilter filter;
    const MarkerFamily* family;
    FilteredPose pose;
    double size_m;
  };
  std::map<std::pair<std::string, int>, Track> tracks_;
  std::vector<Detection> poses_;
};

}  // namespace berth::cli
