#pragma once

#include <functional>

#include "flight_run.hpp"
#include "flight_show.hpp"

namespace berth::cli {

/// A flight played in real time, and what was counted.
struct PlayedFlight {
  FlightLog log;
  /// Pipeline, network and deadlines.
  Json counts;
};

/// Draws the flight's frames into memory, then plays them at FlightOptions::pace into a PilotStream: modes change while
/// it flies. `seen` is called on the calling thread for every frame that was not dropped, with the truth of the frame
/// that its position is of. Throws Error.
PlayedFlight play_flight(const navset::Flight& flight, const FlightOptions& options, Console& console,
                         const FlightWatcher& seen);

}  // namespace berth::cli
