// berth table: the paper's six-axis table, its marker and camera simulated.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <memory>

#include "berth/error.hpp"
#include "commands.hpp"
#include "output_file.hpp"
#include "sim/random.hpp"
#include "table_report.hpp"
#include "table_svg.hpp"

namespace berth::cli {
namespace {

constexpr const char* kExamples = R"(Examples:
  berth table                                    every experiment: tables here, CSV and SVG in ./berth-table
  berth table --only z,rectangle --backend vulkan
  berth table --noise 0 --full-well 0            what is left without noise
  berth table --stations 2 --corners photometric the plate looks back: one camera, the other, both
  berth table --size 0.1 --blur 1.2 --frames 200 --out blurred

Ranges, statistics and what was measured: docs/table.md.)";

const std::vector<std::string>& experiment_names() {
  static const std::vector<std::string> names = {"x", "y", "z", "rx", "ry", "rz", "rectangle", "still", "ranges"};
  return names;
}

struct TableCommand {
  EngineOptions engine;
  table::Nominal nominal;
  sim::Sensor sensor;
  std::vector<std::string> only;
  std::string out = "berth-table";
  int frames = 101;
  int views = 20;
  int stations = 1;
  int fineness = table::kFineness;
  u64 seed = 1;

  bool wants(const std::string& name) const {
    return only.empty() || std::find(only.begin(), only.end(), name) != only.end();
  }
};

std::vector<table::Sweep> sweeps_of(const TableCommand& command) {
  std::vector<table::Sweep> sweeps;
  for (std::size_t axis = 0; axis < 6; ++axis) {
    if (command.wants(table::axis_names()[axis])) {
      sweeps.push_back(table::axis_sweep(axis, command.nominal, command.frames));
    }
  }
  if (command.wants("rectangle")) sweeps.push_back(table::rectangle_sweep(command.nominal, command.frames));
  if (command.wants("still")) sweeps.push_back(table::still_sweep(command.nominal, command.frames));
  if (command.wants("ranges")) {
    for (table::Sweep& cell : table::range_grid(command.views, command.seed)) sweeps.push_back(std::move(cell));
  }
  return sweeps;
}

std::vector<TableSweep> run_all(const TableCommand& command, const table::Stage& stage, TableReaders& readers,
                                Console& console) {
  const std::vector<table::Sweep> sweeps = sweeps_of(command);
  std::size_t all = 0;
  for (const table::Sweep& sweep : sweeps) all += sweep.stops.size();
  std::size_t done = 0;
  const auto progress = [&] {
    ++done;
    if (!console.out_is_terminal()) return;
    console.out() << (done < all ? fmt::format("\r{} of {} frames\x1b[K", done, all) : "\r\x1b[K") << std::flush;
  };
  std::vector<TableSweep> runs;
  for (const table::Sweep& sweep : sweeps) {
    // Every experiment has noise of its own.
    runs.push_back(run_sweep(sweep, stage, sim::scatter(command.seed) + runs.size(), readers, progress));
  }
  return runs;
}

int run_table(const TableCommand& command, Console& console) {
  const CameraModel camera =
      command.engine.camera_file.empty() ? paper_camera() : read_camera(command.engine.camera_file);
  const table::Stage stage(camera, command.sensor, command.fineness);
  TableReaders readers(command.engine, camera, command.stations);
  // Before minutes of work, not after.
  make_folder(command.out, "choose another for --out");
  console.out() << setup_text(stage, command.nominal, command.frames, command.seed,
                              readers.engine() + ", corners by " + command.engine.corners);
  const std::vector<TableSweep> runs = run_all(command, stage, readers, console);
  const MethodNames& methods = readers.names();

  const auto named = [&](const char* name) {
    return std::find_if(runs.begin(), runs.end(), [&](const TableSweep& run) { return run.sweep.name == name; });
  };
  std::vector<std::pair<std::string, std::string>> files = {{"table.csv", table_csv(runs, methods)}};
  if (std::any_of(runs.begin(), runs.end(), [](const TableSweep& run) { return run.sweep.axis.has_value(); })) {
    console.out() << axes_table(runs, methods) << crosstalk_table(runs, methods);
    files.emplace_back("axes.svg", axes_svg(runs, methods));
  }
  if (const auto rectangle = named("rectangle"); rectangle != runs.end()) {
    console.out() << rectangle_table(*rectangle, methods);
    files.emplace_back("rectangle.svg", rectangle_svg(*rectangle, methods));
    files.emplace_back("trajectory.svg", rectangle_trajectory_svg(*rectangle));
  }
  if (const auto still = named("still"); still != runs.end()) console.out() << still_table(*still, methods);
  if (const auto cells = named("ranges"); cells != runs.end()) {
    console.out() << ranges_table({cells, runs.end()}, methods);
  }
  console.out() << '\n';
  for (const auto& [name, text] : files) {
    const std::string path = (std::filesystem::path(command.out) / name).string();
    write_file(path, "the result", text);
    console.out() << "written: " << path << '\n';
  }
  return kOk;
}

}  // namespace

void add_table(CLI::App& app, Console& console, int& exit_code) {
  CLI::App* command = app.add_subcommand("table", "The paper's six-axis table, simulated: errors of every axis");
  const auto options = std::make_shared<TableCommand>();
  command->add_option("--only", options->only, "x, y, z, rx, ry, rz, rectangle, still, ranges [all]")
      ->type_name("NAME")
      ->delimiter(',')
      ->allow_extra_args(false)
      ->check(CLI::IsMember(experiment_names()));
  command->add_option("--size", options->nominal.size_m, "side of the marker's border square, metres")
      ->type_name("METRES")
      ->check(CLI::Range(0.001, 10.0))
      ->capture_default_str();
  command->add_option("--range", options->nominal.range_m, "distance while z stands still, metres")
      ->type_name("METRES")
      ->check(CLI::Range(0.05, 50.0))
      ->capture_default_str();
  command->add_option("--noise", options->sensor.read_noise, "read noise, grey levels")
      ->check(CLI::Range(0.0, 60.0))
      ->capture_default_str();
  command->add_option("--full-well", options->sensor.full_well_e, "electrons at 255 grey levels; 0: no shot noise")
      ->check(CLI::Range(0.0, 1e7))
      ->capture_default_str();
  command->add_option("--blur", options->sensor.blur_sigma_px, "standard deviation of the lens' blur, px")
      ->check(CLI::Range(0.0, 20.0))
      ->capture_default_str();
  command
      ->add_option(
          "--fineness", options->fineness,
          "points a pixel's side where the blur is computed; 1 is quicker, and edges along rows or columns are "
          "then off by some 0.02 px")
      ->check(CLI::Range(1, 8))
      ->capture_default_str();
  command->add_option("--white", options->sensor.white_level, "grey level of a white surface")
      ->check(CLI::Range(20.0, 255.0))
      ->capture_default_str();
  command->add_option("--frames", options->frames, "frames of each experiment but ranges")
      ->check(CLI::Range(2, 100000))
      ->capture_default_str();
  command->add_option("--views", options->views, "frames of each size and range")
      ->check(CLI::Range(1, 100000))
      ->capture_default_str();
  command
      ->add_option("--stations", options->stations,
                   "2: a camera on the plate looks back at a marker beside the first (docs/stations.md)")
      ->check(CLI::Range(1, 2))
      ->capture_default_str();
  command->add_option("--seed", options->seed, "of the noise and the random views")->capture_default_str();
  command->add_option("--camera", options->engine.camera_file, "camera file [the paper's, 640 × 480]")
      ->type_name("FILE");
  command->add_option("--out", options->out, "folder for CSV and SVG")->type_name("DIR")->capture_default_str();
  add_corner_option(*command, options->engine);
  add_backend_options(*command, options->engine);
  command->footer(kExamples);
  command->callback([options, &console, &exit_code] { exit_code = run_table(*options, console); });
}

}  // namespace berth::cli
