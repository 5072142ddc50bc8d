#pragma once

#include <optional>

#include "berth/pilot.hpp"
#include "pilot/mode_switch.hpp"

namespace berth {

/// A configuration that holds, the navigator's camera filled in. Throws Error on one that does not.
PilotConfig checked(PilotConfig config);

/// Where the network is to look first: the target's centre and diameter, px of the frame.
struct Expectation {
  double x_px = 0, y_px = 0, d_px = 0;
};

/// What frames come to for a pilot, whoever has looked at them: the mode, and where the target is.
class Judgement {
 public:
  /// `frames_a_look`: from the frame that the network is given to the one at which it has its say, 0 for the same.
  Judgement(const PilotConfig& config, int frames_a_look);

  Mode mode() const { return mode_switch_.mode(); }
  /// Whether the docking marker was read in the frame at hand.
  bool has_marker() const { return frame_.looked_for_marker && frame_.marker != nullptr; }

  /// One frame: begin, what was looked at, conclude.
  void begin(const FrameStamp& stamp);
  void add(const FrameResult& markers);
  void add(const Sighting& sighting);
  const PilotFrame& conclude();
  /// As it stands; between begin and conclude still with what the last frame said of marker and position.
  const PilotFrame& frame() const { return frame_; }

  /// Should the marker be lost: where it said the target is, since this was asked last.
  std::optional<Expectation> take_expectation();

 private:
  void locate();

  const PilotConfig& config_;
  ModeSwitch mode_switch_;
  PilotFrame frame_;
  std::optional<Expectation> expectation_;
};

}  // namespace berth
