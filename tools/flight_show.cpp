#include "flight_show.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>

#include "film_strip.hpp"
#include "flight_play.hpp"
#include "flight_run.hpp"
#include "flight_svg.hpp"
#include "output_file.hpp"
#include "shared_file.hpp"

namespace berth::cli {
namespace {

namespace fs = std::filesystem;

constexpr int kPictures = 9, kRows = 24;

/// One flight on the screen: a row now and then, and whenever the mode changes.
class FlightTable {
 public:
  FlightTable(int frames, Console& console) : last_(frames - 1), console_(console) {
    console_.out() << "  frame   truth m  mode        position by  range m           direction off\n";
  }

  void add(const FlightPoint& point) {
    if (!point.change.empty())
      console_.out() << wiped() << "  -> " << name_of(point.mode) << ": " << point.change << '\n';
    if (starts_part(point.frame, last_, kRows)) console_.out() << wiped() << row(point) << '\n';
    if (console_.out_is_terminal()) {
      console_.out() << fmt::format("\r  {:3.0f} %\x1b[K", 100.0 * point.frame / last_) << std::flush;
    }
  }
  void end() { console_.out() << wiped(); }

  /// Whether `frame` of 0 … last is the first of one of `parts` parts.
  static bool starts_part(int frame, int last, int parts) {
    return frame == 0 || frame * (parts - 1) / last != (frame - 1) * (parts - 1) / last;
  }

 private:
  const char* wiped() const { return console_.out_is_terminal() ? "\r\x1b[K" : ""; }
  static std::string row(const FlightPoint& p) {
    const std::string begin = fmt::format("  {:>5}  {:>8.3f}  {:<10}  ", p.frame, p.true_range_m, name_of(p.mode));
    if (!p.has_position) return begin + "-";
    const std::string range = p.from_marker ? fmt::format("{:.3f}", p.range_m)
                                            : fmt::format("{:.2f} ± {:.2f}", p.range_m, p.range_deviation_m);
    return begin +
           fmt::format("{:<11}  {:<16}  {:.1f} % of d", p.from_marker ? "marker" : "network", range, 100 * p.off);
  }

  int last_;
  Console& console_;
};

}  // namespace

FlightOnly add_flight_options(CLI::App& command, FlightOptions& options) {
  FlightOnly added{};
  added.network =
      command.add_option("--network", options.network, "the network's file [the one that comes with Berth]")
          ->type_name("FILE");
  added.seed = command.add_option("--seed", options.seed, "the flight, or the first of many")
                   ->type_name("N")
                   ->capture_default_str();
  added.frames = command.add_option("--frames", options.frames, "frames of a flight")
                     ->check(CLI::Range(5, 100000))
                     ->capture_default_str();
  add_backend_options(command, options.engine);
  CLI::Option* backend = command
                             .add_option("--nav-backend", options.navigation.backend,
                                         "the network's backend, where it is not to be the marker's")
                             ->type_name("NAME");
  CLI::Option* fps = command
                         .add_option("--fps", options.pace.fps,
                                     "play one flight in real time, so many frames a second: the network beside the "
                                     "marker's part, drops and late frames counted")
                         ->type_name("N");
  command
      .add_option("--nav-frames", options.navigation.frames,
                  "with --fps: frames until the network's word on one counts [measured]")
      ->type_name("N")
      ->needs(fps);
  command
      .add_option("--nav-record", options.navigation.record,
                  "with --fps: the network's backend and frames from this file; where it is not there, every backend "
                  "is measured and the file written")
      ->type_name("FILE")
      ->needs(fps)
      ->excludes(backend);
  for (CLI::Option* option : add_pace_options(command, options.pace)) option->needs(fps);
  return added;
}

std::string flight_network(const FlightOptions& options) {
  return options.network.empty() ? shared_file("models/lite.berthnet", "name a network by --network") : options.network;
}

Crew::Crew(const FlightOptions& options) : backend(std::move(open_chosen_backends(options.engine).backends[0])) {
  const CameraModel camera = navset::Flight::camera();
  if (!options.navigation.backend.empty()) {
    navigation = open_for_navigation(options.navigation.backend, options.engine);
  }
  pilot = std::make_unique<Pilot>(*backend, navigation ? *navigation : *backend, camera.width, camera.height,
                                  flight_pilot(flight_network(options)));
}

namespace {

PlayedFlight fly_step_by_step(const navset::Flight& flight, const FlightOptions& options, Console& console,
                              const FlightWatcher& seen) {
  const Crew crew(options);
  console.out() << fmt::format("{} on {}\n", crew.backend->name(), crew.backend->device().name);
  return {fly(flight, options.seed, *crew.pilot, seen), {}};
}

}  // namespace

int show_flight(const FlightOptions& options, Console& console) {
  const navset::Flight flight(options.seed, options.frames);
  console.out() << fmt::format("flight {}: {}\n", options.seed, flight.title());
  make_folder(options.out, "name another by --out");
  FilmStrip strip(navset::Flight::camera(), navset::kTargetDiameter_m);
  FlightTable table(options.frames, console);
  const auto watch = [&](const FlightPoint& point, const navset::FlightFrame& truth, const PilotFrame& found) {
    if (FlightTable::starts_part(point.frame, options.frames - 1, kPictures)) {
      strip.add(truth.image.view(), found, fmt::format("{:.2f} m  {}", point.true_range_m, name_of(found.mode)));
    }
    table.add(point);
  };
  const bool is_played = options.pace.fps != 0;
  const PlayedFlight flown =
      is_played ? play_flight(flight, options, console, watch) : fly_step_by_step(flight, options, console, watch);
  table.end();
  const FlightLog& log = flown.log;
  const fs::path out(options.out);
  Json line = to_json(log);
  if (is_played) line["played"] = flown.counts;
  write_file((out / "flight.svg").string(), "the drawing", flight_svg(log));
  write_file((out / "flight.jsonl").string(), "the log", to_line(line) + "\n");
  strip.write((out / "flight.png").string(), 3);
  console.out() << fmt::format("{}; longest gap {} frames, {} frames with something else for the target\n",
                               log.docked() ? "docked" : "NOT docked", log.longest_gap(), log.wrong())
                << fmt::format("drawing     {}\nframes      {}\nlog         {}\n", (out / "flight.svg").string(),
                               (out / "flight.png").string(), (out / "flight.jsonl").string());
  return log.docked() ? kOk : kNoResult;
}

}  // namespace berth::cli
