// berth demo: a simulated flight from the first sight of the target to its marker; or a scenario of markers alone.
#include <filesystem>
#include <memory>

#include "camera/sources.hpp"
#include "commands.hpp"
#include "flight_show.hpp"
#include "output_file.hpp"
#include "stream.hpp"
#include "web_options.hpp"

namespace berth::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExamples = R"(Examples:
  berth demo
  berth demo --backend opencl --out /tmp/demo
  berth demo --fps 30 --frames 240                in real time, once its frames are drawn
  berth demo --scenario scenarios/rectangle.toml --max-frames 100

Writes into --out the whole flight: flight.svg, flight.png, flight.jsonl. With --scenario, markers alone: log.jsonl (a
JSON line a frame, with the truth), trajectory.svg, markers.png.)";

struct DemoCommand {
  FlightOptions flight;
  std::string scenario;
  std::uint64_t max_frames = 0;
  WebOptions web;
};

int show_scenario(const DemoCommand& command, Console& console) {
  const std::unique_ptr<Source> source = open_source("sim:" + command.scenario);
  make_folder(command.flight.out, "name another by --out");
  const fs::path out(command.flight.out);
  StreamOptions stream;
  stream.engine = command.flight.engine;
  stream.max_frames = command.max_frames;
  stream.pace = command.flight.pace;
  stream.log = (out / "log.jsonl").string();
  stream.svg = (out / "trajectory.svg").string();
  stream.picture = (out / "markers.png").string();
  WebOptions web = command.web;
  web.source = "sim:" + command.scenario;
  add_web_observers(web, console.out(), stream.observers);
  console.out() << "scenario    " << command.scenario << '\n';
  return run_stream(*source, stream, console).with_markers > 0 ? kOk : kNoResult;
}

}  // namespace

void add_demo(CLI::App& app, Console& console, int& exit_code) {
  CLI::App* command = app.add_subcommand("demo", "Watch a simulated flight from 6 m to the docked marker");
  const auto options = std::make_shared<DemoCommand>();
  options->flight.out = "berth-demo";
  options->flight.frames = 120;
  const FlightOnly flight = add_flight_options(*command, options->flight);
  CLI::Option* scenario = command->add_option("--scenario", options->scenario, "markers alone, of a scenario file")
                              ->type_name("FILE")
                              ->excludes(flight.network)
                              ->excludes(flight.seed)
                              ->excludes(flight.frames)
                              ->excludes(command->get_option("--nav-backend"))
                              ->excludes(command->get_option("--nav-frames"))
                              ->excludes(command->get_option("--nav-record"));
  command->add_option("--max-frames", options->max_frames, "end a scenario after so many frames, 0 for all")
      ->type_name("N")
      ->capture_default_str()
      ->needs(scenario);
  command->add_option("--out", options->flight.out, "folder for the log and the pictures")
      ->type_name("DIR")
      ->capture_default_str();
  add_report_option(*command, options->web);
  command->get_option("--report")->needs(scenario);
  command->footer(kExamples);
  command->callback([options, &console, &exit_code] {
    exit_code = options->scenario.empty() ? show_flight(options->flight, console) : show_scenario(*options, console);
  });
}

}  // namespace berth::cli
