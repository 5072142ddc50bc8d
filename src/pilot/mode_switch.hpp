#pragma once

#include <algorithm>
#include <optional>

#include "berth/pilot.hpp"

namespace berth {

/// Changes modes by what frames show, with hysteresis: nothing changes on the word of one frame.
class ModeSwitch {
 public:
  /// What a frame showed. Nothing is said of what was not looked for.
  struct Evidence {
    bool looked_for_marker = false;
    std::optional<double> marker_range_m;
    bool looked_for_target = false;
    /// Whether the network saw the target, and where the frame before had it.
    bool sighted = false, followed = false;
  };

  /// `frames_a_look`: from the frame that the network is given to the one at which it has its say, 0 for the
  /// same: a marker that is lost is not given up before.
  explicit ModeSwitch(const HandOver& rules, int frames_a_look = 0)
      : rules_(rules), marker_lost_frames_(std::max(rules.lost_frames, frames_a_look + 1)) {}

  Mode mode() const { return mode_; }
  /// The reason for a change of mode, "" without one.
  const char* update(const Evidence& evidence);

 private:
  const char* change(Mode mode, const char* reason);

  HandOver rules_;
  int marker_lost_frames_;
  Mode mode_ = Mode::search;
  // Frames running.
  int marker_near_ = 0, marker_missing_ = 0, marker_far_ = 0, sighted_ = 0, unsighted_ = 0;
};

}  // namespace berth
