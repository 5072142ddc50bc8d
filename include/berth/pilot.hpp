#pragma once

#include <array>
#include <memory>

#include "berth/detector.hpp"
#include "berth/navigator.hpp"

namespace berth {

/// What the engine is about: looking for the target, following it with the network, reading its marker.
enum class Mode { search, navigation, docking };
const char* name_of(Mode mode);

/// When modes change (docs/hand-over.md). Ranges in metres, the rest in frames.
struct HandOver {
  /// Docking begins when the marker was read in `marker_frames` frames running, no further away than this …
  double docking_m = 1.5;
  int marker_frames = 3;
  /// … and ends when it was not read, or was further away than this, in `lost_frames` frames running.
  double navigation_m = 1.7;
  int lost_frames = 5;
  /// Navigation begins when the network saw the target in so many frames running at one place (a first sighting has
  /// several frames' evidence already, see NavigatorConfig), and ends when it did not see it in `lost_frames`.
  int sighting_frames = 1;
};

struct PilotConfig {
  /// Needs a camera and a marker size.
  DetectorConfig detector;
  /// Its camera is the detector's where it has none.
  NavigatorConfig navigator;
  /// The docking marker's number in the detector's first family.
  int marker = 0;
  /// The target's centre in the marker's frame, m.
  std::array<double, 3> target_in_marker_m = {0, 0, 0};
  HandOver hand_over;
  /// Frames from one look for the marker to the next while the target is far away; near it every frame is looked at.
  int marker_every = 4;
};

/// What one frame came to.
struct PilotFrame {
  FrameStamp stamp;
  Mode mode = Mode::search;
  /// Why the mode changed in this frame; empty where it did not.
  const char* change = "";
  /// Whether the two were asked; where not, their results are of an earlier frame.
  bool looked_for_marker = false, looked_for_target = false;
  const FrameResult* markers = nullptr;
  /// The docking marker, or null.
  const Detection* marker = nullptr;
  const Sighting* sighting = nullptr;
  /// Where the target's centre is in the camera's frame, m, and what says so: the marker before the network.
  bool has_position = false, from_marker = false;
  std::array<double, 3> position_m = {};
  /// ok, no_target or device_lost.
  FrameStatus status = FrameStatus::no_target;
};

/// From the first sight of the target to its marker: navigation and docking mode on frames of one size, with the
/// hand-over between them. Decides by what frames show and by nothing else, so a recording replays to the same modes.
class Pilot {
 public:
  /// The two backends may be one. Throws Error as Detector and Navigator do, and on a configuration without camera,
  /// marker size or order in its ranges.
  Pilot(Backend& docking, Backend& navigation, int width, int height, const PilotConfig& config);
  ~Pilot();
  Pilot(Pilot&&) noexcept;
  Pilot& operator=(Pilot&&) noexcept;

  /// Valid until the next call.
  const PilotFrame& look(View2D<const u8> image, const FrameStamp& stamp = {});

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace berth
