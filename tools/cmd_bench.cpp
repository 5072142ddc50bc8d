// berth bench: how long a docking frame takes on each backend, and where the time and the bytes go.
#include <fmt/format.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <sstream>

#include "berth/error.hpp"
#include "camera/image_file.hpp"
#include "commands.hpp"
#include "engine.hpp"
#include "frame/traffic.hpp"
#include "frame_json.hpp"
#include "output_file.hpp"
#include "quantile.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"

namespace berth::cli {
namespace {

constexpr const char* kExamples = R"(Examples:
  berth bench                                    every backend on frames of the simulated dock
  berth bench --backend simd,vulkan --image photo.png
  berth bench --backend opencl --explain         launches, bytes and time of every operation

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
  std::string report;
};

/// The Jetson TX1 of the paper, for which --explain gives a lower bound: 25.6 GB/s of memory, and what a launch from a
/// stream is taken to cost there. What its 256 cores at 998 MHz add in arithmetic is not in it.
constexpr double kTx1BytesPerNs = 25.6;
constexpr double kTx1LaunchNs = 5000;

struct BenchFrame {
  std::string name;
  GrayImage image;
};

std::vector<BenchFrame> frames_of(const BenchCommand& command) {
  std::vector<BenchFrame> frames;
  for (const std::string& path : command.images) frames.push_back({path, read_gray_image(path)});
  if (!frames.empty()) return frames;
  std::unique_ptr<sim::Renderer> renderer;
  for (int i = 0; i < command.frames; ++i) {
    // Spread over the whole approach.
    const sim::Scene scene =
        sim::corpus_scene("dock", i * sim::kCorpusFrames / command.frames, command.width, command.height);
    if (!renderer) renderer = std::make_unique<sim::Renderer>(scene.camera);
    frames.push_back({"dock_" + std::to_string(i), renderer->render(scene)});
  }
  return frames;
}

/// Medians over frames of the best of several runs of each, ms.
struct Times {
  double processor = 0, wall = 0, wall_p95 = 0, device = 0, decode = 0;
};

Times measure(Engine& engine, const std::vector<BenchFrame>& frames, int repeat) {
  std::vector<double> processor, wall, device, decode;
  for (const BenchFrame& frame : frames) {
    double best[4] = {1e9, 1e9, 1e9, 1e9};
    for (int i = 0; i < repeat; ++i) {
      const TimedResult timed = engine.detect(frame.image.view(), {});
      if (timed.frame.status == FrameStatus::device_lost) throw Error(frame.name + ": the device was lost");
      best[0] = std::min(best[0], ms_of(timed.cpu_ns));
      best[1] = std::min(best[1], ms_of(timed.wall_ns));
      best[2] = std::min(best[2], ms_of(timed.frame.times[0].ns));
      best[3] = std::min(best[3], ms_of(timed.frame.times[1].ns));
    }
    processor.push_back(best[0]);
    wall.push_back(best[1]);
    device.push_back(best[2]);
    decode.push_back(best[3]);
  }
  return {quantile(processor, 0.5), quantile(wall, 0.5), quantile(wall, 0.95), quantile(device, 0.5),
          quantile(decode, 0.5)};
}

/// Launches, bytes and time of one frame's plan, operation by operation.
Json explain(Backend& backend, const BenchFrame& frame, std::ostream& out) {
  const View2D<const u8> image = frame.image.view();
  MarkerPlan plan(backend, image.width, image.height, {});
  const std::unique_ptr<Stream> stream = backend.make_stream();
  std::vector<u8> padded(plan.geometry().frame_bytes());
  pad_frame(image, plan.geometry(), padded.data());
  stream->upload(plan.frame(), padded.data(), padded.size());
  stream->replay(plan.plan());
  if (!stream->finish()) throw Error(frame.name + ": the device was lost");
  std::vector<std::int64_t> times = stream->time_steps(plan.plan());
  for (int i = 0; i < 5 && !times.empty(); ++i) {
    const std::vector<std::int64_t> again = stream->time_steps(plan.plan());
    for (std::size_t k = 0; k < times.size(); ++k) times[k] = std::min(times[k], again[k]);
  }
  StageReader reader(plan, *stream);
  const std::vector<StepTraffic> steps = step_traffic(reader);

  std::size_t downloaded = 0;
  for (const MarkerSearch& search : plan.searches()) {
    downloaded += search.contours->bytes() + search.quads->bytes() + search.edges->bytes();
  }
  Json list = Json::array();
  std::size_t read = 0, written = 0;
  double time_us = 0, tx1_us = 0;
  out << fmt::format("\n{} on {}, frame {}\n", backend.name(), backend.device().name, frame.name)
      << fmt::format("  {:<18} {:>7} {:>10} {:>10} {:>9} {:>12}\n", "operation", "groups", "read KB", "written KB",
                     "us", "TX1 least us");
  for (std::size_t i = 0; i < steps.size(); ++i) {
    const StepTraffic& step = steps[i];
    const double bytes = static_cast<double>(step.read + step.written);
    const double least_us = (kTx1LaunchNs + bytes / kTx1BytesPerNs) / 1e3;
    const double us = times.empty() ? 0 : static_cast<double>(times[i]) / 1e3;
    out << fmt::format("  {:<18} {:>7} {:>10.1f} {:>10.1f} {:>9} {:>12.1f}\n", name_of(step.op), step.groups,
                       static_cast<double>(step.read) / 1e3, static_cast<double>(step.written) / 1e3,
                       times.empty() ? "-" : fmt::format("{:.1f}", us), least_us);
    list.push_back(
        {{"operation", name_of(step.op)}, {"groups", step.groups}, {"read", step.read}, {"written", step.written}});
    if (!times.empty()) list.back()["us"] = us;
    read += step.read;
    written += step.written;
    time_us += us;
    tx1_us += least_us;
  }
  out << fmt::format("  {:<18} {:>7} {:>10.1f} {:>10.1f} {:>9} {:>12.1f}\n", fmt::format("{} launches", steps.size()),
                     "", static_cast<double>(read) / 1e3, static_cast<double>(written) / 1e3,
                     times.empty() ? "-" : fmt::format("{:.1f}", time_us), tx1_us)
      << fmt::format("  upload {:.1f} KB, download {:.1f} KB, device memory {:.1f} MB\n",
                     static_cast<double>(padded.size()) / 1e3, static_cast<double>(downloaded) / 1e3,
                     static_cast<double>(plan.device_bytes()) / 1e6)
      << fmt::format("  TX1 least: {:.1f} GB/s and {:.0f} us a launch; arithmetic is not counted\n", kTx1BytesPerNs,
                     kTx1LaunchNs / 1e3);
  return {{"launches", steps.size()}, {"read", read}, {"written", written}, {"uploaded", padded.size()},
          {"downloaded", downloaded}, {"steps", list}};
}

int run_bench(const BenchCommand& command, Console& console) {
  const std::vector<BenchFrame> frames = frames_of(command);
  const std::vector<std::string>& names = command.backends.empty() ? backend_names() : command.backends;
  const View2D<const u8> first = frames.front().image.view();
  console.out() << fmt::format("docking mode, {} frame{} of {}x{}, medians of the best of {}\n", frames.size(),
                               frames.size() == 1 ? "" : "s", first.width, first.height, command.repeat)
                << fmt::format("{:<10} {:>9} {:>9} {:>9} {:>9} {:>9} {:>10}  {}\n", "backend", "wall ms", "p95",
                               "device", "decode", "cpu ms", "frames/s", "on");
  Json report = Json::array();
  std::ostringstream explanations;  // after the table
  for (const std::string& name : names) {
    EngineOptions options;
    options.backend = name;
    options.device = command.backend.device;
    options.threads = command.backend.threads;
    options.fallback = "none";
    EngineBackends backends;
    try {
      backends = open_chosen_backends(options);
    } catch (const Error& error) {
      if (!command.backends.empty()) throw;
      console.out() << fmt::format("{:<10} absent: {}\n", name, error.what());
      continue;
    }
    Engine engine(std::move(backends), DetectorConfig{});
    const Times times = measure(engine, frames, command.repeat);
    console.out() << fmt::format("{:<10} {:>9.3f} {:>9.3f} {:>9.3f} {:>9.3f} {:>9.3f} {:>10.0f}  {}\n", name,
                                 times.wall, times.wall_p95, times.device, times.decode, times.processor,
                                 1e3 / times.wall, engine.backend().device().name)
                  << std::flush;
    Json json = {{"backend", name},
                 {"device", engine.backend().device().name},
                 {"driver", engine.backend().device().driver},
                 {"wall_ms", times.wall},
                 {"wall_p95_ms", times.wall_p95},
                 {"device_ms", times.device},
                 {"decode_ms", times.decode},
                 {"processor_ms", times.processor}};
    if (command.explain) json["explain"] = explain(engine.backend(), frames[frames.size() / 2], explanations);
    report.push_back(json);
  }
  console.out() << explanations.str();
  if (command.report.empty()) return kOk;
  write_file(command.report, "the report", to_line(report) + '\n');
  return kOk;
}

}  // namespace

void add_bench(CLI::App& app, Console& console, int& exit_code) {
  CLI::App* command = app.add_subcommand("bench", "Time a docking frame on each backend; show where its time goes");
  const auto options = std::make_shared<BenchCommand>();
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
  command->add_flag("--explain", options->explain, "launches, bytes and time of every operation of one frame");
  command->add_option("--json", options->report, "a report for machines")->type_name("FILE");
  command->footer(kExamples);
  command->callback([options, &console, &exit_code] { exit_code = run_bench(*options, console); });
}

}  // namespace berth::cli
