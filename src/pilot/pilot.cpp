#include "berth/pilot.hpp"

#include <algorithm>
#include <cmath>
#include <string>

#include "berth/error.hpp"
#include "pilot/mode_switch.hpp"
#include "pose_algebra.hpp"

namespace berth {
namespace {

/// So much further than where docking begins every frame is searched for the marker.
constexpr double kNear = 1.5;

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

struct Pilot::Impl {
  Impl(Backend& docking, Backend& navigation, int width, int height, const PilotConfig& wanted)
      : config(checked(wanted)),
        detector(docking, width, height, config.detector),
        navigator(navigation, width, height, config.navigator),
        mode_switch(config.hand_over) {}

  /// Far away the network finds the way; a look for the marker now and then is enough.
  bool wants_marker() const {
    if (mode_switch.mode() == Mode::docking || frame.marker != nullptr) return true;
    if (frame.has_position && near()) return true;
    return frames % config.marker_every == 0;
  }
  bool near() const {
    const auto& p = frame.position_m;
    return std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) < kNear * config.hand_over.docking_m;
  }

  void look_for_marker(View2D<const u8> image, const FrameStamp& stamp) {
    const FrameResult& result = detector.detect(image, stamp);
    frame.looked_for_marker = true;
    frame.markers = &result;
    frame.marker = nullptr;
    if (result.status == FrameStatus::device_lost) frame.status = FrameStatus::device_lost;
    for (const Detection& detection : result.detections) {
      if (detection.id == config.marker && detection.has_pose &&
          detection.family->name == config.detector.families.front()) {
        frame.marker = &detection;
      }
    }
  }

  void look_for_target(View2D<const u8> image, const FrameStamp& stamp) {
    const Sighting& sighting = navigator.look(image, stamp);
    frame.looked_for_target = true;
    frame.sighting = &sighting;
    if (sighting.status == FrameStatus::device_lost) frame.status = FrameStatus::device_lost;
  }

  void locate() {
    const CameraModel& camera = *config.detector.camera;
    if (frame.marker != nullptr && mode_switch.mode() == Mode::docking) {
      const Pose& pose = frame.marker->pose;
      const auto& at = config.target_in_marker_m;
      for (std::size_t i = 0; i < 3; ++i) {
        frame.position_m[i] = pose.R[3 * i] * at[0] + pose.R[3 * i + 1] * at[1] + pose.R[3 * i + 2] * at[2] + pose.t[i];
      }
      frame.has_position = frame.from_marker = true;
      // Should the marker be lost, the network knows where to look.
      const auto& p = frame.position_m;
      const auto image_point = image_of(camera, p);
      navigator.expect(image_point[0], image_point[1],
                       (camera.fx + camera.fy) / 2 * config.navigator.target_diameter_m / p[2]);
      return;
    }
    const bool sighted = frame.looked_for_target && frame.sighting->status == FrameStatus::ok;
    if (!sighted || !frame.sighting->has_range || mode_switch.mode() == Mode::search) return;
    for (std::size_t i = 0; i < 3; ++i) frame.position_m[i] = frame.sighting->bearing[i] * frame.sighting->range_m;
    frame.has_position = true;
  }

  PilotConfig config;
  Detector detector;
  Navigator navigator;
  ModeSwitch mode_switch;
  PilotFrame frame;
  int frames = 0;
};

Pilot::Pilot(Backend& docking, Backend& navigation, int width, int height, const PilotConfig& config)
    : impl_(std::make_unique<Impl>(docking, navigation, width, height, config)) {}
Pilot::~Pilot() = default;
Pilot::Pilot(Pilot&&) noexcept = default;
Pilot& Pilot::operator=(Pilot&&) noexcept = default;

const PilotFrame& Pilot::look(View2D<const u8> image, const FrameStamp& stamp) {
  Impl& it = *impl_;
  PilotFrame& frame = it.frame;
  const bool for_marker = it.wants_marker();
  frame.stamp = stamp;
  frame.status = FrameStatus::no_target;
  frame.looked_for_marker = frame.looked_for_target = false;
  if (for_marker) it.look_for_marker(image, stamp);
  // In docking mode the network helps out where the marker is not read.
  if (it.mode_switch.mode() != Mode::docking || frame.marker == nullptr) it.look_for_target(image, stamp);
  ModeSwitch::Evidence evidence;
  evidence.looked_for_marker = frame.looked_for_marker;
  if (frame.looked_for_marker && frame.marker != nullptr) {
    evidence.marker_range_m =
        range_by_size(*frame.marker, *it.config.detector.camera, it.config.detector.marker_size_m);
  }
  evidence.looked_for_target = frame.looked_for_target;
  if (frame.looked_for_target) {
    evidence.sighted = frame.sighting->status == FrameStatus::ok;
    evidence.followed = frame.sighting->tracked;
  }
  frame.change = it.mode_switch.update(evidence);
  frame.mode = it.mode_switch.mode();
  frame.has_position = frame.from_marker = false;
  if (!frame.looked_for_marker) frame.marker = nullptr;
  it.locate();
  if (frame.status != FrameStatus::device_lost && frame.has_position) frame.status = FrameStatus::ok;
  ++it.frames;
  return frame;
}

}  // namespace berth
