#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <exception>
#include <opencv2/core/utils/logger.hpp>
#include <string>
#include <utility>
#include <vector>

#include "berth/error.hpp"
#include "commands.hpp"
#include "run_config.hpp"

namespace berth::cli {
namespace {

constexpr const char* kExamples = R"(Examples:
  berth demo                                     a simulated flight, first sight to docked
  berth detect photo.jpg                         the markers in a photo, as a table
  berth detect --json --family tag36h11 photos/  the same for a folder, as JSON lines
  berth flight                                   from 6 m to the docked marker, with the network
  berth run --source video:approach.mp4 --camera cam.yaml --size 0.08
  berth run --source sim:scenarios/port.toml --target targets/port.yaml   discs and rings
  berth run --source v4l2:video0 --record flight.mcap     frames and results, for Foxglove, rosbag2 and replay
  berth replay flight.mcap --backend opencl      the recording again: the same bits
  berth view flight.mcap                         looked through in a browser, frame by frame
  berth recover flight.mcap                      after a loss of power: all that is whole
  berth verify                                   every backend against the reference, bit by bit
  berth bench --explain                          how long a frame takes on each backend, and where
  berth eval models/lite.berthnet sets/disjoint  how well a navigation network knows the target
  berth model show models/lite.berthnet          its layers, with their sizes and costs
  berth print-tag tag36h11 7 --size 0.08 --out tag.pdf   a marker on paper, at true size
  berth plan --size 0.08                         predicted pose errors, decode range, frame rate
  berth table                                    the paper's six-axis table, simulated: errors of every axis
  berth calibrate --board aprilgrid --grid 5x7 --size 0.03 --out cam.yaml images/
  berth survey --camera cam.yaml --marker-size 0.05 --out bundle.yaml images/
  berth stations scenarios/stations.toml         the robot's and the dock's camera together
  berth config --explain                         the keys of a file for berth run --config
  berth doctor                                   what this machine has, and what it lacks

Exit codes: 0 all well; 1 verify, eval, replay or run --lockstep found a difference, a flight did not dock,
calibrate or survey refused the views, chaos or soak found what must not be; 2 bad input or usage.)";

/// "a, b or c": the commands below one; empty where there are none.
std::string choices_of(const CLI::App& command) {
  std::string text;
  const std::vector<const CLI::App*> choices = command.get_subcommands(nullptr);
  for (std::size_t i = 0; i < choices.size(); ++i) {
    text += (i == 0 ? "" : i + 1 < choices.size() ? ", " : " or ") + choices[i]->get_name();
  }
  return text;
}

}  // namespace

int run_command(int argc, const char* const* argv, Console& console) {
  CLI::App app("Docking vision: marker frames in, 6-DOF poses out, with the same bits on every machine.", "berth");
  app.footer(kExamples);
  app.set_version_flag("--version", "berth " BERTH_VERSION);
  app.require_subcommand(1);
  app.failure_message([](const CLI::App* failed, const CLI::Error& error) {
    return "berth: command line: " + std::string(error.what()) + "; see " + failed->get_display_name() + " --help\n";
  });
  int exit_code = kOk;
  add_calibrate(app, console, exit_code);
  add_chaos(app, console, exit_code);
  add_demo(app, console, exit_code);
  add_detect(app, console, exit_code);
  add_flight(app, console, exit_code);
  add_run(app, console, exit_code);
  add_replay(app, console, exit_code);
  add_view(app, console, exit_code);
  add_recover(app, console, exit_code);
  add_verify(app, console, exit_code);
  add_bench(app, console, exit_code);
  add_eval(app, console, exit_code);
  add_model(app, console, exit_code);
  add_print_tag(app, console, exit_code);
  add_plan(app, console, exit_code);
  add_soak(app, console, exit_code);
  add_stations(app, console, exit_code);
  add_survey(app, console, exit_code);
  add_table(app, console, exit_code);
  add_doctor(app, console, exit_code);
  add_config(app, console);
  // What OpenCV has to say about a file, Berth says better.
  if (std::getenv("OPENCV_LOG_LEVEL") == nullptr) cv::utils::logging::setLogLevel(cv::utils::logging::LOG_LEVEL_ERROR);
  try {
    std::vector<std::string> arguments = with_config(*app.get_subcommand("run"), {argv + 1, argv + argc});
    std::reverse(arguments.begin(), arguments.end());  // as CLI11 wants them
    app.parse(std::move(arguments));
  } catch (const CLI::RequiredError& error) {
    // CLI11 tells a mistyped command only as the lack of one.
    const CLI::App* command = &app;
    int word = 1;
    for (; !command->get_subcommands().empty(); ++word) command = command->get_subcommands().front();
    const std::string given = argc > word ? argv[word] : "";
    const std::string choices = choices_of(*command);
    if (!choices.empty() && !given.empty() && given[0] != '-') {
      console.complain("command line: field '" + (word == 1 ? "command" : command->get_name()) + "' is '" + given +
                       "'; use " + choices);
    } else {
      app.exit(error, console.out(), console.err());
    }
    return kBadInput;
  } catch (const CLI::ParseError& error) {
    return app.exit(error, console.out(), console.err()) == 0 ? kOk : kBadInput;
  } catch (const Error& error) {
    console.complain(error.what());
  } catch (const std::bad_alloc&) {
    console.complain("out of memory; use smaller images or fewer at a time");
  } catch (const std::exception& error) {
    console.complain(std::string("unexpected: ") + error.what());
  }
  console.out().flush();
  if (!console.out()) console.complain("standard output: writing failed; check the disk or the pipe");
  return console.complained() ? static_cast<int>(kBadInput) : exit_code;
}

}  // namespace berth::cli
