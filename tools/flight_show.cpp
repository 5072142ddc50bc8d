#include "flight_show.hpp"

#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <filesystem>

#include "film_strip.hpp"
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
  return added;
}

Crew::Crew(const FlightOptions& options) : backend(std::move(open_chosen_backends(options.engine).backends[0])) {
  const CameraModel camera = navset::Flight::camera();
  const std::string network =
      options.network.empty() ? shared_file("models/lite.berthnet", "name a network by --network") : options.network;
  pilot = std::make_unique<Pilot>(*backend, *backend, camera.width, camera.height, flight_pilot(network));
}

int show_flight(const FlightOptions& options, Console& console) {
  const Crew crew(options);
  const navset::Flight flight(options.seed, options.frames);
  console.out() << fmt::format("flight {}: {}; {} on {}\n", options.seed, flight.title(), crew.backend->name(),
                               crew.backend->device().name);
  make_folder(options.out, "name another by --out");
  FilmStrip strip(navset::Flight::camera(), navset::kTargetDiameter_m);
  FlightTable table(options.frames, console);
  const auto watch = [&](const FlightPoint& point, const navset::FlightFrame& truth, const PilotFrame& found) {
    if (FlightTable::starts_part(point.frame, options.frames - 1, kPictures)) {
      strip.add(truth.image.view(), found, fmt::format("{:.2f} m  {}", point.true_range_m, name_of(found.mode)));
    }
    table.add(point);
  };
  const FlightLog log = fly(flight, options.seed, *crew.pilot, watch);
  table.end();
  const fs::path out(options.out);
  write_file((out / "flight.svg").string(), "the drawing", flight_svg(log));
  write_file((out / "flight.jsonl").string(), "the log", to_line(to_json(log)) + "\n");
  strip.write((out / "flight.png").string(), 3);
  console.out() << fmt::format("{}; longest gap {} frames, {} frames with something else for the target\n",
                               log.docked() ? "docked" : "NOT docked", log.longest_gap(), log.wrong())
                << fmt::format("drawing     {}\nframes      {}\nlog         {}\n", (out / "flight.svg").string(),
                               (out / "flight.png").string(), (out / "flight.jsonl").string());
  return log.docked() ? kOk : kNoResult;
}

}  // namespace berth::cli
