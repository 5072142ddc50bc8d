#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "berth/pilot.hpp"
#include "commands.hpp"
#include "engine.hpp"
#include "navigation_choice.hpp"
#include "paced_play.hpp"

namespace berth::cli {

/// A simulated flight, and who flies it.
struct FlightOptions {
  std::string network;  ///< a file; empty for the one that comes with Berth
  std::string out;      ///< folder for drawing, frames and log
  EngineOptions engine;
  NavigationOptions navigation;
  /// In real time, through a PilotStream; not with fps 0.
  PaceOptions pace;
  /// As StreamOptions, with a pace.
  double known_answer_s = 0;
  std::uint64_t seed = 1;
  int frames = 240;
};

/// Options that only a flight has.
struct FlightOnly {
  CLI::Option* network;
  CLI::Option* seed;
  CLI::Option* frames;
};

/// Adds these and the backend's.
FlightOnly add_flight_options(CLI::App& command, FlightOptions& options);

/// The network's file. Throws Error where Berth's own is not found.
std::string flight_network(const FlightOptions& options);

/// A pilot for simulated flights and the backends it runs on. Throws Error.
struct Crew {
  explicit Crew(const FlightOptions& options);
  std::unique_ptr<Backend> backend;
  /// The network's, where it is another.
  std::unique_ptr<Backend> navigation;
  std::unique_ptr<Pilot> pilot;
};

/// Flies once, with a table as it goes; writes flight.svg, flight.png and flight.jsonl. Returns the exit code.
int show_flight(const FlightOptions& options, Console& console);

}  // namespace berth::cli
