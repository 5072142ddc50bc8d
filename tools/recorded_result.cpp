#include "recorded_result.hpp"

#include <algorithm>
#include <array>
#include <cmath>

#include "berth/error.hpp"
#include "camera/recorded_number.hpp"
#include "camera/recorded_pose.hpp"

namespace berth::cli {
namespace {

/// Stages' names are pointed to, not kept.
constexpr std::array<const char*, 5> kStages = {"device", "decode", "pose", "corners", "discs"};

/// The one of an enumeration's values, 0 to `count` - 1, that has this name.
template <class Enum>
Enum named(const std::string& name, std::size_t count) {
  for (std::size_t i = 0; i < count; ++i) {
    if (name == name_of(static_cast<Enum>(i))) return static_cast<Enum>(i);
  }
  throw Error("'" + name + "' is not known; it is of a later version");
}

std::int64_t ns_of_us(const Json& us) { return static_cast<std::int64_t>(std::llround(us.get<double>() * 1e3)); }

PoseUncertainty uncertainty_of(const Json& json) {
  PoseUncertainty uncertainty;
  uncertainty.covariance = json.at("covariance").get<std::array<double, 36>>();
  uncertainty.error_px = json.at("error_px").get<double>();
  const double ambiguity = json.at("ambiguity").get<double>();
  if (!json.contains("other")) return uncertainty;
  uncertainty.has_other = true;
  uncertainty.other = recorded_pose(json.at("other"));
  uncertainty.other_error_px = json.at("other").at("error_px").get<double>();
  // Not recorded: any two that have this ratio.
  uncertainty.chi_square = ambiguity * ambiguity;
  uncertainty.other_excess = 1 - uncertainty.chi_square;
  return uncertainty;
}

Detection detection_of(const Json& json) {
  Detection detection;
  detection.family = &family(json.at("family").get<std::string>());
  detection.id = whole_number<int>(json, "id");
  detection.hamming = whole_number<int>(json, "hamming");
  detection.margin = json.at("margin").get<double>();
  detection.corners = json.at("corners").get<std::array<std::array<double, 2>, 4>>();
  detection.center = json.at("center").get<std::array<double, 2>>();
  if (!json.contains("pose")) return detection;
  detection.has_pose = true;
  detection.pose = recorded_pose(json.at("pose"));
  if (json.at("pose").contains("covariance")) detection.pose_uncertainty = uncertainty_of(json.at("pose"));
  return detection;
}

/// What bundles and targets have in common.
template <class Posed>
Posed posed(const Json& json) {
  Posed one;
  one.used = whole_number<int>(json, "used");
  one.has_pose = json.contains("pose");
  if (!one.has_pose) return one;
  one.pose = recorded_pose(json.at("pose"));
  one.uncertainty = uncertainty_of(json.at("pose"));
  return one;
}

DiscPose disc_pose(const Json& json) {
  DiscPose pose = posed<DiscPose>(json);
  if (!json.contains("discs")) return pose;
  const Json& discs = json.at("discs");
  for (std::size_t i = 0; i < discs.size() && i < pose.discs.size(); ++i) {
    if (discs[i].is_null()) continue;
    pose.discs[i].seen = true;
    pose.discs[i].center_px = discs[i].at("center").get<std::array<double, 2>>();
  }
  return pose;
}

TruthMarker truth_marker(const Json& json) {
  TruthMarker marker;
  marker.family = json.at("family").get<std::string>();
  marker.id = whole_number<int>(json, "id");
  marker.size_m = json.at("size").get<double>();
  marker.pose = recorded_pose(json.at("pose"));
  return marker;
}

TrackedFrame tracked_frame(const Json& json) {
  TrackedFrame tracked;
  tracked.whole = json.at("whole").get<bool>();
  tracked.why = named<SearchReason>(json.at("why").get<std::string>(), kSearchReasons);
  for (const Json& window : json.at("windows")) {
    SearchWindow& one = tracked.windows.emplace_back();
    one.x = whole_number<int>(window, "x");
    one.y = whole_number<int>(window, "y");
    one.side = whole_number<int>(window, "side");
  }
  return tracked;
}

}  // namespace

RecordedResult::RecordedResult(const Json& record, const DetectorConfig& config,
                               const std::optional<CameraModel>& camera, const std::string& backend,
                               const std::string& name)
    : camera_(camera), backend_(backend) {
  try {
    read(record, config);
  } catch (const std::exception& error) {
    throw Error(name + ": its record cannot be read (" + error.what() + "); the recording is damaged");
  }
}

void RecordedResult::read(const Json& record, const DetectorConfig& config) {
  result_.stamp.sequence = whole_number<u64>(record, "frame");
  result_.stamp.mid_exposure_ns = whole_number<std::int64_t>(record, "mid_exposure_ns");
  // Whose clock it was says nothing any more.
  result_.stamp.clock = record.at("clock").get<std::string>() == "none" ? "none" : "recorded";
  label_ = record.at("label").get<std::string>();
  constexpr std::size_t kStatuses = static_cast<std::size_t>(FrameStatus::device_lost) + 1;
  result_.status = named<FrameStatus>(record.at("status").get<std::string>(), kStatuses);
  mode_ = named<Mode>(record.at("mode").get<std::string>(), static_cast<std::size_t>(Mode::docking) + 1);
  result_.quads = whole_number<int>(record, "quads");
  for (const Json& detection : record.at("detections")) result_.detections.push_back(detection_of(detection));
  if (record.contains("bundles")) {
    for (const Json& bundle : record.at("bundles")) result_.bundles.push_back(posed<BundlePose>(bundle));
  }
  if (record.contains("targets")) {
    for (const Json& target : record.at("targets")) result_.disc_targets.push_back(disc_pose(target));
  }
  // They are named by the configuration's.
  if (result_.bundles.size() > config.bundles.size() || result_.disc_targets.size() > config.disc_targets.size()) {
    throw Error("it has poses of more bundles or targets than were looked for");
  }
  if (record.contains("truth")) {
    for (const Json& marker : record.at("truth")) truth_.push_back(truth_marker(marker));
  }
  std::size_t stages = 0;
  for (const char* stage : kStages) {
    const Json& times = record.at("stages_us");
    if (times.contains(stage)) result_.times[stages++] = {stage, ns_of_us(times.at(stage))};
  }
  if (record.contains("laps_us")) {
    paced_.emplace();
    for (std::size_t i = 0; i < kLaps; ++i) {
      paced_->laps_ns[i] = ns_of_us(record.at("laps_us").at(name_of(static_cast<Lap>(i))));
    }
  }
  if (record.contains("search")) tracked_ = tracked_frame(record.at("search"));
  if (record.contains("missed")) missed_ = record.at("missed").get<std::uint64_t>();
}

ObservedFrame RecordedResult::observed(View2D<const u8> image) const {
  return {label_,
          image,
          result_,
          0,
          mode_,
          camera_,
          tracked_ ? &*tracked_ : nullptr,
          paced_ ? &*paced_ : nullptr,
          truth_,
          truth_targets_,
          backend_.c_str(),
          0,
          {},
          {},
          nullptr,
          nullptr};
}

}  // namespace berth::cli
