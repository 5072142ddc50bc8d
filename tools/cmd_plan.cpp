// berth plan: what a marker and a camera will be good for.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>

#include "berth/error.hpp"
#include "camera/bad_input.hpp"
#include "commands.hpp"
#include "engine.hpp"
#include "exact_math.hpp"
#include "plan/predict.hpp"
#include "quantile.hpp"
#include "sim/geometry.hpp"
#include "table/stage.hpp"

namespace berth::cli {
namespace {

constexpr const char* kExamples = R"(Examples:
  berth plan --size 0.08                                         the paper's camera, from 0.2 to 1.5 m
  berth plan --size 0.08 --lens 6 --pixel 4.8 --image 1280x960 --range 0.3,1,3
  berth plan --size 0.08 --exposure 8 --speed 0.1 --blur 1       moving across the view at 0.1 m/s

One standard deviation of a frame's pose. The model, and how well it was checked: docs/plan.md.)";

constexpr int kRanges = 8;
constexpr int kTimedFrames = 21;

struct PlanCommand {
  EngineOptions engine;
  std::string family = table::kFamily;
  std::string range = "0.2:1.5";
  std::string image = "640x480";
  double lens_mm = 0;
  double pixel_um = 0;
  double angle_deg = 30;
  double exposure_ms = 2;
  double readout_ms = 3;
  double speed_m_s = 0;
  plan::View view;
};

/// "FROM:TO" in even ratios, or a list.
std::vector<double> ranges_of(const std::string& text) {
  const auto wrong = [&text] {
    return bad_field("command line", "--range", "'" + text + "'",
                     "give FROM:TO or a list like 0.5,1,2, metres from 0.01 to 1000");
  };
  std::vector<double> ranges;
  std::size_t at = 0;
  const bool span = text.find(':') != std::string::npos;
  while (at <= text.size()) {
    const std::size_t end = std::min(text.size(), text.find(span ? ':' : ',', at));
    try {
      ranges.push_back(parse_size(text.substr(at, end - at)));
    } catch (const Error&) {
      throw wrong();
    }
    if (ranges.back() < 0.01) throw wrong();
    at = end + 1;
  }
  if (!span) return ranges;
  if (ranges.size() != 2) throw wrong();
  const double from = ranges[0];
  const double ratio = std::pow(ranges[1] / from, 1.0 / (kRanges - 1));
  ranges.clear();
  for (int i = 0; i < kRanges; ++i) ranges.push_back(from * std::pow(ratio, i));
  return ranges;
}

/// From a file, from lens and pixel, or the paper's.
CameraModel camera_of(const PlanCommand& command) {
  if (!command.engine.camera_file.empty()) return read_camera(command.engine.camera_file);
  if (!(command.lens_mm > 0) && !(command.pixel_um > 0)) return paper_camera();
  if (!(command.lens_mm > 0) || !(command.pixel_um > 0)) {
    throw Error("command line: give --lens and --pixel together, or --camera, or none for the paper's camera");
  }
  CameraModel camera;
  int used = 0;
  if (std::sscanf(command.image.c_str(), "%5dx%5d%n", &camera.width, &camera.height, &used) != 2 ||
      used != static_cast<int>(command.image.size()) || std::min(camera.width, camera.height) < 16 ||
      std::max(camera.width, camera.height) > 16384) {
    throw bad_field("command line", "--image", "'" + command.image + "'",
                    "give WIDTHxHEIGHT in px, 16 to 16384 each, e.g. 640x480");
  }
  camera.fx = camera.fy = 1000 * command.lens_mm / command.pixel_um;
  camera.cx = 0.5 * (camera.width - 1);
  camera.cy = 0.5 * (camera.height - 1);
  return camera;
}

plan::View view_at(const PlanCommand& command, double range_m) {
  plan::View view = command.view;
  view.pose = sim::translation(0, 0, range_m);
  view.pose.R = sim::rotation_y(sim::radians(command.angle_deg));
  view.motion_px = command.speed_m_s * command.exposure_ms / 1000 * view.camera.fx / range_m;
  return view;
}

/// Median time of a frame that shows the marker, ms by the clock on the wall.
double frame_ms(const PlanCommand& command, double range_m, std::string& engine_name) {
  DetectorConfig config;
  config.camera = command.view.camera;
  config.marker_size_m = command.view.size_m;
  Engine engine(open_chosen_backends(command.engine), config);
  engine_name = engine.describe();
  const plan::View view = view_at(command, range_m);
  const table::StageFrame frame = table::Stage(view.camera, view.sensor).look({0, view.size_m, view.pose}, 1);
  std::vector<double> times;
  for (int i = 0; i < kTimedFrames; ++i) {
    times.push_back(static_cast<double>(engine.detect(frame.image.view(), {}).wall_ns) / 1e6);
  }
  return quantile(times, 0.5);
}

std::string row(const PlanCommand& command, const MarkerFamily& shape, double range_m) {
  const plan::View view = view_at(command, range_m);
  plan::Prediction p;
  if (!plan::fits(view, shape) || !plan::predict(view, p)) return fmt::format("| {:.3f} | does not fit |\n", range_m);
  if (!plan::readable(view, shape)) {
    return fmt::format("| {:.3f} | {:.1f} | too far |\n", range_m, p.corners.side_px);
  }
  const auto mm = [&](std::size_t i) { return 1000 * p.deviation[i]; };
  const auto degrees = [&](std::size_t i) { return kDegrees * p.deviation[i]; };
  return fmt::format("| {:.3f} | {:.1f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} | {:.3f} |\n",
                     range_m, p.corners.side_px, p.corners.corner_px, mm(0), mm(1), mm(2), 100 * p.position_m / range_m,
                     degrees(3), degrees(4), degrees(5));
}

int run_plan(PlanCommand command, Console& console) {
  const MarkerFamily& shape = family(command.family);
  const std::vector<double> ranges = ranges_of(command.range);
  command.view.camera = camera_of(command);
  const CameraModel& camera = command.view.camera;
  const plan::CornerNoise noise = plan::corner_noise(view_at(command, ranges.back()));
  console.out() << fmt::format(
      "marker      {}, side {:g} mm, tilted by {:g}°, fully lit\n"
      "camera      {}×{}, f {:.2f} {:.2f} px\n"
      "sensor      contrast {:.0f}, noise {:.2f} grey levels; blur of an edge {:.2f} px at {:g} m\n\n"
      "| range m | side px | corner px | x mm | y mm | z mm | % of range | rx ° | ry ° | rz ° |\n"
      "|---|---|---|---|---|---|---|---|---|---|\n",
      shape.name, 1000 * command.view.size_m, command.angle_deg, camera.width, camera.height, camera.fx, camera.fy,
      noise.contrast, noise.noise, noise.blur_px, ranges.back());
  for (const double range_m : ranges) console.out() << row(command, shape, range_m);

  const double decode_m = plan::decode_range_m(view_at(command, ranges.front()), shape);
  console.out() << fmt::format("\ndecode range {:.2f} m (nine of ten frames)\n", decode_m);
  std::string engine;
  const double process_ms = frame_ms(command, std::max(decode_m / 2, 3 * command.view.size_m), engine);
  const double period_ms = std::max({command.exposure_ms, command.readout_ms, process_ms});
  const char* limit = period_ms == process_ms            ? "this machine"
                      : period_ms == command.exposure_ms ? "the exposure"
                                                         : "the readout";
  console.out() << fmt::format(
      "frame rate  {:.0f} frames/s: {} sets it (exposure {:g} ms, readout {:g} ms, {:.2f} ms a frame here, {})\n",
      1000 / period_ms, limit, command.exposure_ms, command.readout_ms, process_ms, engine);
  return kOk;
}

}  // namespace

void add_plan(CLI::App& app, Console& console, int& exit_code) {
  CLI::App* command = app.add_subcommand("plan", "Predict pose errors, decode range and frame rate of a set-up");
  const auto options = std::make_shared<PlanCommand>();
  command->add_option("--size", options->view.size_m, "side of the marker's border square, metres")
      ->type_name("METRES")
      ->check(CLI::Range(0.001, 10.0))
      ->required();
  command->add_option("--family", options->family, "marker family")->type_name("NAME")->capture_default_str();
  command->add_option("--range", options->range, "distances: FROM:TO or a list, metres")->capture_default_str();
  command->add_option("--angle", options->angle_deg, "tilt of the marker, degrees")
      ->check(CLI::Range(0.0, 80.0))
      ->capture_default_str();
  command
      ->add_option("--camera", options->engine.camera_file,
                   "camera file: ROS, Kalibr or PhotonVision [the paper's, 640 × 480]")
      ->type_name("FILE");
  command->add_option("--lens", options->lens_mm, "focal length, mm, in place of --camera")
      ->check(CLI::Range(0.1, 1e4));
  command->add_option("--pixel", options->pixel_um, "pitch of the sensor's pixels, micrometres")
      ->check(CLI::Range(0.1, 100.0));
  command->add_option("--image", options->image, "the sensor's pixels")->type_name("WxH")->capture_default_str();
  command->add_option("--exposure", options->exposure_ms, "ms")->check(CLI::Range(0.001, 1e4))->capture_default_str();
  command->add_option("--readout", options->readout_ms, "ms a frame, beside the next exposure")
      ->check(CLI::Range(0.0, 1e4))
      ->capture_default_str();
  command->add_option("--speed", options->speed_m_s, "of the marker across the view, m/s")
      ->check(CLI::Range(0.0, 1e3))
      ->capture_default_str();
  command->add_option("--white", options->view.sensor.white_level, "grey level of white at that exposure")
      ->check(CLI::Range(20.0, 255.0))
      ->capture_default_str();
  command->add_option("--noise", options->view.sensor.read_noise, "read noise, grey levels")
      ->check(CLI::Range(0.0, 60.0))
      ->capture_default_str();
  command->add_option("--full-well", options->view.sensor.full_well_e, "electrons at 255 grey levels; 0: no shot noise")
      ->check(CLI::Range(0.0, 1e7))
      ->capture_default_str();
  command->add_option("--blur", options->view.sensor.blur_sigma_px, "standard deviation of the lens' blur, px")
      ->check(CLI::Range(0.0, 20.0))
      ->capture_default_str();
  add_backend_options(*command, options->engine);
  command->footer(kExamples);
  command->callback([options, &console, &exit_code] { exit_code = run_plan(*options, console); });
}

}  // namespace berth::cli
