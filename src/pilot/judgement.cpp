#include "pilot/judgement.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>

#include "berth/error.hpp"
#include "pose_algebra.hpp"

namespace berth {
namespace {

/// By its longest side, which tilt shortens least: for decisions, where a small marker's pose is too noisy.
double range_by_size(const Detection& marker, const CameraModel& camera, double size_m) {
  double longest = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const auto a = camera.undistort(marker.corners[i][0], marker.corners[i][1]);
    const auto b = camera.undistort(marker.corners[(i + 1) % 4][0], marker.corners[(i + 1) % 4][1]);
    const double dx = a[0] - b[0];
    const double dy = a[1] - b[1];
    longest = std::max(longest, std::sqrt(dx * dx + dy * dy));
  }
  return size_m / longest;
}

}  // namespace

PilotConfig checked(PilotConfig config) {
  if (!config.detector.camera) throw Error("a pilot needs a camera; give its camera_info file");
  if (!(config.detector.marker_size_m > 0)) throw Error("a pilot needs the docking marker's size; give metres above 0");
  const HandOver& rules = config.hand_over;
  if (!(rules.docking_m > 0) || !(rules.navigation_m >= rules.docking_m)) {
    throw Error("docking_m is " + std::to_string(rules.docking_m) + " and navigation_m " +
                std::to_string(rules.navigation_m) + "; give metres above 0, the latter no smaller than the former");
  }
  for (const int frames : {rules.marker_frames, rules.lost_frames, rules.sighting_frames, config.marker_every}) {
    if (frames < 1) throw Error("a hand-over after " + std::to_string(frames) + " frames; give 1 or more");
  }
  if (!config.navigator.camera) config.navigator.camera = config.detector.camera;
  return config;
}

Judgement::Judgement(const PilotConfig& config, int frames_a_look)
    : config_(config), mode_switch_(config.hand_over, frames_a_look) {}

void Judgement::begin(const FrameStamp& stamp) {
  frame_.stamp = stamp;
  frame_.status = FrameStatus::no_target;
  frame_.looked_for_marker = frame_.looked_for_target = false;
}

void Judgement::add(const FrameResult& markers) {
  frame_.looked_for_marker = true;
  frame_.markers = &markers;
  frame_.marker = nullptr;
  if (markers.status == FrameStatus::device_lost) frame_.status = FrameStatus::device_lost;
  for (const Detection& detection : markers.detections) {
    if (detection.id == config_.marker && detection.has_pose &&
        detection.family->name == config_.detector.families.front()) {
      frame_.marker = &detection;
    }
  }
}

void Judgement::add(const Sighting& sighting) {
  frame_.looked_for_target = true;
  frame_.sighting = &sighting;
  if (sighting.status == FrameStatus::device_lost) frame_.status = FrameStatus::device_lost;
}

const PilotFrame& Judgement::conclude() {
  ModeSwitch::Evidence evidence;
  evidence.looked_for_marker = frame_.looked_for_marker;
  if (has_marker()) {
    evidence.marker_range_m = range_by_size(*frame_.marker, *config_.detector.camera, config_.detector.marker_size_m);
  }
  evidence.looked_for_target = frame_.looked_for_target;
  if (frame_.looked_for_target) {
    evidence.sighted = frame_.sighting->status == FrameStatus::ok;
    evidence.followed = frame_.sighting->tracked;
  }
  frame_.change = mode_switch_.update(evidence);
  frame_.mode = mode_switch_.mode();
  frame_.has_position = frame_.from_marker = false;
  if (!frame_.looked_for_marker) frame_.marker = nullptr;
  locate();
  if (frame_.status != FrameStatus::device_lost && frame_.has_position) frame_.status = FrameStatus::ok;
  return frame_;
}

void Judgement::locate() {
  const CameraModel& camera = *config_.detector.camera;
  if (frame_.marker != nullptr && mode() == Mode::docking) {
    const Pose& pose = frame_.marker->pose;
    const auto& at = config_.target_in_marker_m;
    for (std::size_t i = 0; i < 3; ++i) {
      frame_.position_m[i] = pose.R[3 * i] * at[0] + pose.R[3 * i + 1] * at[1] + pose.R[3 * i + 2] * at[2] + pose.t[i];
    }
    frame_.has_position = frame_.from_marker = true;
    const auto image_point = image_of(camera, frame_.position_m);
    expectation_ =
        Expectation{image_point[0], image_point[1],
                    (camera.fx + camera.fy) / 2 * config_.navigator.target_diameter_m / frame_.position_m[2]};
    return;
  }
  const bool sighted = frame_.looked_for_target && frame_.sighting->status == FrameStatus::ok;
  if (!sighted || !frame_.sighting->has_range || mode() == Mode::search) return;
  for (std::size_t i = 0; i < 3; ++i) frame_.position_m[i] = frame_.sighting->bearing[i] * frame_.sighting->range_m;
  frame_.has_position = true;
}

std::optional<Expectation> Judgement::take_expectation() { return std::exchange(expectation_, std::nullopt); }

}  // namespace berth
