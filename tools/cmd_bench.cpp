// berth bench: how long a docking frame takes on each backend, where the time and the bytes go, and what that makes of
// machines that are only described.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>

#include "bench_explain.hpp"
#include "bench_frames.hpp"
#include "berth/error.hpp"
#include "camera/image_file.hpp"
#include "commands.hpp"
#include "machine.hpp"
#include "output_file.hpp"
#include "shared_file.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"

namespace berth::cli {
namespace {

constexpr const char* kExamples = R"(Examples:
  berth bench                                    every backend on frames of the simulated dock
  berth bench --backend simd,vulkan --image photo.png
  berth bench --explain                          bytes, operations and time of every operation, measured and predicted
  berth bench --explain --machine tx1            and by calculation for a machine that is described
  berth bench --describe-machine here.toml --backend simd   describes this one, by what it measures
  berth bench --markdown bench.md --svg bench.svg --json bench.json

Times of one run compare; those of two runs on a busy machine do not.)";

struct BenchCommand {
  std::vector<std::string> backends;
  std::vector<std::string> images;
  BackendOptions backend;
  int frames = 20;
  int repeat = 10;
  int width = 640;
  int height = 480;
  bool explain = false;
  std::vector<std::string> machines;
  std::vector<std::string> modes;
  std::string describe;
  std::string json, markdown, svg;
};

/// Tables go to the terminal at once and into the report at the end.
struct BenchOutput {
  Console& console;
  std::string markdown;
  void show(const BenchTable& table) {
    console.out() << aligned(table) << std::flush;
    markdown += cli::markdown(table);
  }
  void show(const std::vector<BenchTable>& tables) {
    for (const BenchTable& table : tables) show(table);
  }
};

std::vector<BenchFrame> frames_of(const BenchCommand& command) {
  std::vector<BenchFrame> frames;
  for (const std::string& path : command.images) frames.push_back({path, read_gray_image(path)});
  return frames.empty() ? dock_frames(command.frames, command.width, command.height) : frames;
}

/// What machines are calibrated on: no frame that is then predicted.
BenchFrame calibration_frame(const BenchCommand& command) {
  const sim::Scene scene = sim::corpus_scene("cluttered", 0, command.width, command.height);
  return {"cluttered_0", sim::Renderer(scene.camera).render(scene)};
}

/// A description's file, or the name of one that comes with Berth.
work::Machine machine_of(const std::string& name) {
  const bool is_file = name.find('/') != std::string::npos || name.find(".toml") != std::string::npos;
  return work::read_machine(is_file
                                ? name
                                : shared_file("bench/machines/" + name + ".toml",
                                              "give --machine a file, or tx1, jetson-nano, orin-nano, pi5 or rk3588"));
}

EngineBackends open_one(const BenchCommand& command, const std::string& name) {
  EngineOptions options;
  options.backend = name;
  options.device = command.backend.device;
  options.threads = command.backend.threads;
  options.fallback = "none";
  return open_chosen_backends(options);
}

int describe_machine(const BenchCommand& command, Console& console) {
  if (command.backends.size() > 1) {
    throw Error("--describe-machine: " + std::to_string(command.backends.size()) +
                " backends; name one by --backend, a description is one backend's");
  }
  const std::string name = command.backends.empty() ? "simd" : command.backends.front();
  const EngineBackends opened = open_one(command, name);
  Backend& backend = *opened.backends.front();
  const BenchFrame frame = calibration_frame(command);
  const work::Machine machine = work::measure_machine(backend, frame.image.view());
  const Processor processor = this_processor();
  const std::string remark = fmt::format(
      "Measured by berth bench --describe-machine, backend {}, on {} ({} processors), {}.\nBandwidths by copies, rates "
      "by "
      "{} and a convolution; cycles of simple operations and quotients are taken.",
      name, processor.model, processor.threads, this_system(), frame.name);
  const std::string text = work::machine_text(machine, remark);
  write_file(command.describe, "the description", text);
  console.out() << text;
  return kOk;
}

/// The table of backends; those that are not there are named where all are asked for. Returns those that were timed.
std::vector<BackendTimes> time_backends(const BenchCommand& command, const std::vector<BenchFrame>& frames,
                                        const std::vector<std::string>& names, BenchOutput& output) {
  const View2D<const u8> first = frames.front().image.view();
  std::vector<BackendTimes> all;
  std::string absent;
  for (const std::string& name : names) {
    EngineBackends backends;
    try {
      backends = open_one(command, name);
    } catch (const Error& error) {
      if (!command.backends.empty()) throw;
      absent += fmt::format("{}{}: {}", absent.empty() ? "absent: " : "; ", name, error.what());
      continue;
    }
    DetectorConfig config;
    config.camera = paper_camera(first.width, first.height);
    config.marker_size_m = 0.1;
    Engine engine(std::move(backends), config);
    const FrameTimes times = time_frames(engine, frames, command.repeat);
    const DeviceInfo device = engine.backend().device();
    all.push_back({name, device.name, device.driver, times});
  }
  BenchTable table = frame_table(fmt::format("docking mode, {} frame{} of {}x{}, {} runs each", frames.size(),
                                             frames.size() == 1 ? "" : "s", first.width, first.height, command.repeat),
                                 all);
  if (!absent.empty()) table.note += "\n  " + absent;
  output.show(table);
  return all;
}

Json explain(const BenchCommand& command, const std::vector<work::Machine>& machines,
             const std::vector<BenchFrame>& frames, const std::vector<BackendTimes>& timed, BenchOutput& output) {
  const BenchFrame& frame = frames[frames.size() / 2];
  const ExplainedModes modes(command.modes, frame);
  output.show(count_tables(modes));
  const BenchFrame calibration = calibration_frame(command);
  std::vector<MeasuredBackend> measured;
  for (const BackendTimes& one : timed) {
    if (one.backend == "reference") continue;  // it is not the kernel text that is counted
    const EngineBackends opened = open_one(command, one.backend);
    measured.push_back(measure_backend(*opened.backends.front(), calibration, modes));
  }
  const View2D<const u8> image = frame.image.view();
  output.show(
      measured_tables(modes, measured, static_cast<std::size_t>(image.width) * static_cast<std::size_t>(image.height)));
  const PredictionError error = prediction_error(measured);
  if (!machines.empty()) output.show(projection_tables(modes, machines, error));
  output.show(paper_table(modes, measured, timed, machines));
  Json json = {{"counted", Json::array()}, {"measured", Json::array()}, {"projected", Json::array()}};
  for (const ExplainedMode& mode : modes.modes()) json["counted"].push_back(to_json(mode));
  for (const MeasuredBackend& one : measured) json["measured"].push_back(to_json(one, modes));
  for (const work::Machine& machine : machines) json["projected"].push_back(projection_json(modes, machine));
  json["prediction"] = {{"typical_frame_factor", error.typical_frame},
                        {"worst_frame_factor", error.worst_frame},
                        {"typical_step_factor", error.typical_step},
                        {"frames", error.frames}};
  return json;
}

int run_bench(const BenchCommand& command, Console& console) {
  if (!command.describe.empty()) return describe_machine(command, console);
  std::vector<work::Machine> machines;  // what is wrong with a file is said before anything is measured
  for (const std::string& name : command.machines) machines.push_back(machine_of(name));
  const std::vector<BenchFrame> frames = frames_of(command);
  BenchOutput output{console, ""};
  const std::vector<BackendTimes> timed =
      time_backends(command, frames, command.backends.empty() ? backend_names() : command.backends, output);
  Json report = {{"processor", this_processor().model}, {"system", this_system()}, {"backends", Json::array()}};
  for (const BackendTimes& one : timed) report["backends"].push_back(to_json(one));
  if (command.explain) report["explain"] = explain(command, machines, frames, timed, output);
  if (!command.json.empty()) write_file(command.json, "the report", to_line(report) + '\n');
  if (!command.markdown.empty()) {
    write_file(command.markdown, "the tables",
               fmt::format("{}, {}\n{}", this_processor().model, this_system(), output.markdown));
  }
  if (!command.svg.empty()) {
    write_file(command.svg, "the drawing", frame_bars_svg("A docking frame on " + this_processor().model, timed));
  }
  return kOk;
}

}  // namespace

void add_bench(CLI::App& app, Console& console, int& exit_code) {
  CLI::App* command = app.add_subcommand("bench", "Time a docking frame on each backend; show where its time goes");
  const auto options = std::make_shared<BenchCommand>();
  options->modes = {"docking", "lite", "paper"};
  command->add_option("--backend", options->backends, "backend to time; may be repeated or a comma list [all]")
      ->type_name("NAME")
      ->delimiter(',')
      ->allow_extra_args(false);
  command->add_option("--device", options->backend.device, "its device, by index or by a part of its name")
      ->type_name("DEVICE");
  command->add_option("--threads", options->backend.threads, "threads of the CPU backends, 0 for every core")
      ->type_name("N")
      ->capture_default_str();
  command->add_option("--image", options->images, "image to time, in place of the simulated dock; may be repeated")
      ->type_name("FILE")
      ->allow_extra_args(false);
  command->add_option("--frames", options->frames, "frames of the simulated dock")
      ->type_name("N")
      ->check(CLI::Range(1, sim::kCorpusFrames))
      ->capture_default_str();
  command->add_option("--width", options->width, "of the simulated dock, px")
      ->check(CLI::Range(240, 4096))
      ->capture_default_str();
  command->add_option("--height", options->height, "px")->check(CLI::Range(180, 4096))->capture_default_str();
  command->add_option("--repeat", options->repeat, "runs of each frame; the best counts")
      ->type_name("N")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  CLI::Option* explain =
      command->add_flag("--explain", options->explain,
                        "bytes, operations and time of every operation of one frame, measured and predicted");
  command
      ->add_option("--machine", options->machines,
                   "a machine to calculate for: a description's file, or tx1, jetson-nano, orin-nano, pi5, rk3588; may "
                   "be repeated or a comma list")
      ->type_name("NAME")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->needs(explain);
  command->add_option("--modes", options->modes, "what is explained")
      ->type_name("NAME")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(bench_mode_names()))
      ->capture_default_str()
      ->needs(explain);
  command->add_option("--describe-machine", options->describe, "measure this machine and write its description")
      ->type_name("FILE.toml")
      ->excludes(explain);
  command->add_option("--json", options->json, "a report for machines")->type_name("FILE");
  command->add_option("--markdown", options->markdown, "the tables as Markdown")->type_name("FILE");
  command->add_option("--svg", options->svg, "a frame's time on each backend, drawn")->type_name("FILE");
  command->footer(kExamples);
  command->callback([options, &console, &exit_code] { exit_code = run_bench(*options, console); });
}

}  // namespace berth::cli
