// berth demo: a simulated approach through docking, with the errors against its truth.
#include <filesystem>
#include <memory>

#include "berth/error.hpp"
#include "camera/sources.hpp"
#include "commands.hpp"
#include "output_file.hpp"
#include "shared_file.hpp"
#include "stream.hpp"

namespace berth::cli {
namespace {

namespace fs = std::filesystem;

constexpr const char* kExamples = R"(Examples:
  berth demo
  berth demo --backend opencl --out /tmp/demo
  berth demo --scenario scenarios/rectangle.toml --max-frames 100

Writes into --out: log.jsonl (a JSON line a frame, with the truth), trajectory.svg, markers.png.)";

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
    const std::string scenario = options->scenario.empty()
                                     ? shared_file("scenarios/approach.toml", "name a scenario by --scenario")
                                     : options->scenario;
    const std::unique_ptr<Source> source = open_source("sim:" + scenario);
    make_folder(options->out, "name another by --out");
    const fs::path out(options->out);
    options->stream.log = (out / "log.jsonl").string();
    options->stream.svg = (out / "trajectory.svg").string();
    options->stream.picture = (out / "markers.png").string();
    console.out() << "scenario    " << scenario << '\n';
    exit_code = run_stream(*source, options->stream, console).with_markers > 0 ? kOk : kNoResult;
  });
}

}  // namespace berth::cli
