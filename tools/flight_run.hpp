#pragma once

#include <functional>
#include <string>
#include <vector>

#include "berth/pilot.hpp"
#include "frame_json.hpp"
#include "navset/flight.hpp"

namespace berth::cli {

/// One frame of a simulated flight: what the pilot made of it, beside the truth.
struct FlightPoint {
  int frame = 0;
  Mode mode = Mode::search;
  std::string change;
  bool has_position = false, from_marker = false;
  /// The network saw a target, whether or not the mode believed it.
  bool sighted = false;
  /// Distance from the camera to the target's centre, m.
  double true_range_m = 0, range_m = 0, range_deviation_m = 0;
  /// Between the true and the found direction, as a share of the target's diameter in the image.
  double off = 0;
  /// Something else was taken for the target: its direction is off by more than the target's radius.
  bool wrong() const { return has_position && off > 0.5; }
};

/// A flight from end to end.
struct FlightLog {
  u64 seed = 0;
  std::string title;
  std::vector<FlightPoint> points;

  /// First frame in a mode, -1 where there is none.
  int first(Mode mode) const;
  /// Frames with neither marker nor sighting running, from the first position on.
  int longest_gap() const;
  int wrong() const;
  int sightings() const;
  bool docked() const { return !points.empty() && points.back().mode == Mode::docking && points.back().from_marker; }
};

/// What simulated flights need of a pilot, beside the network.
PilotConfig flight_pilot(const std::string& network);

/// What a pilot made of a frame, beside the truth of the frame that its position is of.
FlightPoint flight_point(int index, const navset::FlightFrame& truth, const PilotFrame& found);

/// Flies with a new pilot. `seen` is called after every frame.
using FlightWatcher = std::function<void(const FlightPoint&, const navset::FlightFrame&, const PilotFrame&)>;
FlightLog fly(const navset::Flight& flight, u64 seed, Pilot& pilot, const FlightWatcher& seen = {});

/// Seed, title, docked, first frames, longest gap, wrong frames, sightings, every change of mode with its
/// reason, median errors of range and direction by what gave the position.
Json to_json(const FlightLog& log);

}  // namespace berth::cli
