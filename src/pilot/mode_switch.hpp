#pragma once

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

  explicit ModeSwitch(const HandOver& rules) : rules_(rules) {}

  Mode mode() const { return mode_; }
  /// The reason for a change of mode, "" without one.
  const char* update(const Evidence& evidence);

 private:
  const char* change(Mode mode, const char* reason);

  HandOver rules_;
  Mode mode_ = Mode::search;
  // Frames running.
  int marker_near_ = 0, marker_missing_ = 0, marker_far_ = 0, sighted_ = 0, unsighted_ = 0;
};

}  // namespace berth
