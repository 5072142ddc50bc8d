#include "bench_explain.hpp"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "berth/error.hpp"
#include "navigation/network.hpp"
#include "shared_file.hpp"

namespace berth::cli {
namespace {

/// Of a network's groups one in so many is counted: they are alike.
constexpr int kEveryWindow = 8;
constexpr int kEverySearch = 64;

}  // namespace

const std::vector<std::string>& bench_mode_names() {
  static const std::vector<std::string> names = {"docking", "lite", "paper", "lite-search", "paper-search"};
  return names;
}

ExplainedModes::ExplainedModes(const std::vector<std::string>& names, const BenchFrame& frame)
    : paper_(work::paper_sized_network()) {
  const auto asked = [&names](const char* name) { return std::find(names.begin(), names.end(), name) != names.end(); };
  if (asked("lite") || asked("lite-search")) {
    lite_ = read_network(shared_file("models/lite.berthnet", "leave the modes lite and lite-search out"));
  }
  for (const std::string& name : bench_mode_names()) {
    if (asked(name.c_str())) add(name, frame);
  }
}

void ExplainedModes::add(const std::string& name, const BenchFrame& frame) {
  const View2D<const u8> image = frame.image.view();
  const bool search = name == "lite-search" || name == "paper-search";
  ExplainedMode mode;
  mode.name = name;
  mode.counted_only = search;
  int every = 1;
  if (name == "docking") {
    mode.describes = "the docking plan on " + frame.name;
    mode.on = [image](Backend& backend) { return work::docking_frame(backend, image); };
  } else {
    const Network& network = name == "lite" || name == "lite-search" ? lite_ : paper_;
    const int width = search ? work::search_side(image.width, network.side) : network.side;
    const int height = search ? work::search_side(image.height, network.side) : network.side;
    mode.describes = network.name + (search ? " over the whole frame, a window of " : " over one window of ") +
                     std::to_string(width) + "x" + std::to_string(height);
    mode.on = [image, &network, width, height](Backend& backend) {
      return work::network_frame(backend, image, network, width, height);
    };
    every = search ? kEverySearch : kEveryWindow;
  }
  const std::unique_ptr<Backend> host = open_backend("cpu");
  mode.load = work::count_frame(*mode.on(*host), *host, every);
  modes_.push_back(std::move(mode));
}

MeasuredBackend measure_backend(Backend& backend, const BenchFrame& calibration, const ExplainedModes& modes) {
  constexpr int kRuns = 5;
  constexpr double kBudget_ms = 200;
  MeasuredBackend measured;
  measured.backend = backend.name();
  measured.device = backend.device().name;
  measured.machine = work::measure_machine(backend, calibration.image.view());
  const std::unique_ptr<work::ModeFrame> sample = work::docking_frame(backend, calibration.image.view());
  const std::unique_ptr<Stream> stream = backend.make_stream();
  measured.upload_us = work::least_us(backend, kBudget_ms, [&] {
    sample->upload(*stream);
    if (!stream->finish()) throw Error(measured.backend + ": the device was lost");
  });
  for (const ExplainedMode& mode : modes.modes()) {
    if (mode.counted_only) continue;
    const std::unique_ptr<work::ModeFrame> frame = mode.on(backend);
    MeasuredMode one;
    one.frame = work::frame_time_us(backend, *frame, kBudget_ms);
    one.steps = work::step_times_us(backend, *frame, kRuns);
    one.predicted = work::project(mode.load, measured.machine);
    measured.modes.push_back(std::move(one));
  }
  return measured;
}

PredictionError prediction_error(const std::vector<MeasuredBackend>& measured) {
  PredictionError error;
  double frames = 0, steps = 0;
  int step_count = 0;
  for (const MeasuredBackend& backend : measured) {
    for (const MeasuredMode& mode : backend.modes) {
      const double off = std::fabs(std::log(mode.predicted.us / mode.frame));
      frames += off;
      error.worst_frame = std::max(error.worst_frame, std::exp(off));
      ++error.frames;
      for (std::size_t i = 0; i < mode.steps.size(); ++i) {
        // Below a µs and twice the launch a step says more of the clock than of the model.
        if (mode.steps[i] < std::max(1.0, 2 * backend.machine.launch_us)) continue;
        steps += std::fabs(std::log(mode.predicted.steps[i].us / mode.steps[i]));
        ++step_count;
      }
    }
  }
  if (error.frames > 0) error.typical_frame = std::exp(frames / error.frames);
  if (step_count > 0) error.typical_step = std::exp(steps / step_count);
  return error;
}

Json to_json(const ExplainedMode& mode) {
  Json steps = Json::array();
  std::size_t read = 0, written = 0, uploaded = 0, downloaded = 0;
  for (const work::StepLoad& step : mode.load.steps) {
    Json kinds = Json::object();
    for (std::size_t k = 0; k < work::kKinds; ++k) kinds[work::kKindNames[k]] = step.work.slots[0][k];
    steps.push_back({{"operation", name_of(step.work.op)},
                     {"groups", step.work.groups},
                     {"read", step.traffic.read},
                     {"written", step.traffic.written},
                     {"operations", kinds},
                     {"span", step.work.span},
                     {"steps", step.work.steps},
                     {"chain", step.work.chain}});
    read += step.traffic.read;
    written += step.traffic.written;
  }
  for (const ArgumentTraffic& copy : mode.load.uploads) uploaded += copy.bytes;
  for (const ArgumentTraffic& copy : mode.load.downloads) downloaded += copy.bytes;
  return {{"mode", mode.name},    {"launches", mode.load.steps.size()}, {"read", read},  {"written", written},
          {"uploaded", uploaded}, {"downloaded", downloaded},           {"steps", steps}};
}

Json to_json(const MeasuredBackend& measured, const ExplainedModes& modes) {
  Json list = Json::array();
  auto at = measured.modes.begin();
  for (const ExplainedMode& mode : modes.modes()) {
    if (mode.counted_only) continue;
    Json steps = Json::array();
    for (std::size_t i = 0; i < at->steps.size(); ++i) {
      steps.push_back({{"operation", name_of(mode.load.steps[i].work.op)},
                       {"us", at->steps[i]},
                       {"predicted_us", at->predicted.steps[i].us}});
    }
    list.push_back(
        {{"mode", mode.name}, {"frame_us", at->frame}, {"predicted_us", at->predicted.us}, {"steps", steps}});
    ++at;
  }
  return {{"backend", measured.backend}, {"device", measured.device}, {"modes", list}};
}

Json projection_json(const ExplainedModes& modes, const work::Machine& machine) {
  Json list = Json::array();
  for (const ExplainedMode& mode : modes.modes()) {
    const work::FrameTime time = work::project(mode.load, machine);
    Json steps = Json::array();
    for (std::size_t i = 0; i < time.steps.size(); ++i) {
      const work::StepTime& step = time.steps[i];
      steps.push_back({{"operation", name_of(mode.load.steps[i].work.op)},
                       {"us", step.us},
                       {"bytes_us", step.bytes_us},
                       {"work_us", step.work_us},
                       {"way_us", step.way_us}});
    }
    list.push_back({{"mode", mode.name}, {"us", time.us}, {"copies_us", time.copies_us}, {"steps", steps}});
  }
  return {{"machine", machine.name}, {"modes", list}};
}

}  // namespace berth::cli
