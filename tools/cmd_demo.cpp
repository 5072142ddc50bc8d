// berth demo: a simulated approach through docking, with the errors against its truth.
#include <filesystem>
#include <memory>

#include "berth/error.hpp"
#include "camera/sources.hpp"
#include "commands.hpp"
#include "stream.hpp"

namespace berth::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExamples = R"(Examples:
  berth demo
  berth demo --backend opencl --out /tmp/demo
  berth demo --scenario scenarios/rectangle.toml --max-frames 100

Writes into --out: log.jsonl (a JSON line a frame, with the truth), trajectory.svg, markers.png.)";

/// The built-in scenario: installed beside the command, or in the source tree it was built from.
std::string built_in_scenario() {
  const fs::path in_share = fs::path("share") / "berth" / "scenarios" / "approach.toml";
  std::error_code error;
  const fs::path program = fs::read_symlink("/proc/self/exe", error);
  const fs::path candidates[] = {program.parent_path().parent_path() / in_share,
                                 fs::path(BERTH_SOURCE_DIR) / "scenarios" / "approach.toml",
                                 fs::path("scenarios") / "approach.toml"};
  for (const fs::path& candidate : candidates) {
    if (fs::exists(candidate, error)) return candidate.string();
  }
  throw Error(candidates[0].string() +
              ": the demo's scenario is not there; install Berth whole, or name one by --scenario");
}

}  // namespace

void add_demo(CLI::App& app, Console& console, int& exit_code) {
  struct Options {
    std::string scenario;
    std::string out = "berth-demo";
    StreamOptions stream;
  };
  CLI::App* command = app.add_subcommand("demo", "Watch a simulated approach and docking, no camera needed");
  const auto options = std::make_shared<Options>();
  command->add_option("--scenario", options->scenario, "scenario file [approach.toml]")->type_name("FILE");
  command->add_option("--out", options->out, "folder for the log and the pictures")
      ->type_name("DIR")
      ->capture_default_str();
  command->add_option("--max-frames", options->stream.max_frames, "end after so many frames, 0 for all")
      ->type_name("N")
      ->capture_default_str();
  add_backend_options(*command, options->stream.engine);
  command->footer(kExamples);
  command->callback([options, &console, &exit_code] {
    const std::string scenario = options->scenario.empty() ? built_in_scenario() : options->scenario;
    const std::unique_ptr<Source> source = open_source("sim:" + scenario);
    std::error_code error;
    fs::create_directories(options->out, error);
    if (error) {
      throw Error(options->out + ": the folder cannot be made (" + error.message() + "); name another by --out");
    }
    const fs::path out(options->out);
    options->stream.log = (out / "log.jsonl").string();
    options->stream.svg = (out / "trajectory.svg").string();
    options->stream.picture = (out / "markers.png").string();
    console.out() << "scenario    " << scenario << '\n';
    exit_code = run_stream(*source, options->stream, console).with_markers > 0 ? kOk : kNoResult;
  });
}

}  // namespace berth::cli
