#include "pilot/mode_switch.hpp"

namespace berth {

const char* name_of(Mode mode) {
  switch (mode) {
    case Mode::search:
      return "search";
    case Mode::navigation:
      return "navigation";
    default:
      return "docking";
  }
}

const char* ModeSwitch::update(const Evidence& evidence) {
  if (evidence.looked_for_marker) {
    const bool seen = evidence.marker_range_m.has_value();
    marker_near_ = seen && *evidence.marker_range_m <= rules_.docking_m ? marker_near_ + 1 : 0;
    marker_missing_ = seen ? 0 : marker_missing_ + 1;
    marker_far_ = seen && *evidence.marker_range_m > rules_.navigation_m ? marker_far_ + 1 : 0;
  }
  if (evidence.looked_for_target) {
    // A sighting elsewhere begins anew.
    sighted_ = !evidence.sighted ? 0 : evidence.followed ? sighted_ + 1 : 1;
    unsighted_ = evidence.sighted ? 0 : unsighted_ + 1;
  }
  switch (mode_) {
    case Mode::docking:
      if (marker_missing_ >= marker_lost_frames_) {
        if (sighted_ > 0) return change(Mode::navigation, "the marker was not read any more");
        return change(Mode::search, "neither marker nor target is seen any more");
      }
      if (marker_far_ >= rules_.lost_frames) return change(Mode::navigation, "the marker is far away");
      return "";
    case Mode::navigation:
      if (marker_near_ >= rules_.marker_frames) return change(Mode::docking, "the marker is read and near");
      if (unsighted_ >= rules_.lost_frames) return change(Mode::search, "the target is not seen any more");
      return "";
    default:
      if (marker_near_ >= rules_.marker_frames) return change(Mode::docking, "the marker is read and near");
      if (sighted_ >= rules_.sighting_frames) return change(Mode::navigation, "the target is seen");
      return "";
  }
}

const char* ModeSwitch::change(Mode mode, const char* reason) {
  mode_ = mode;
  marker_missing_ = marker_far_ = unsighted_ = 0;
  if (mode != Mode::docking) marker_near_ = 0;
  return reason;
}

}  // namespace berth
