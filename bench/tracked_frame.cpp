// What a frame costs that is searched in windows, beside the same frame searched whole: processor time over a scenario.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "berth/backend.hpp"
#include "berth/tracker.hpp"
#include "clock.hpp"
#include "run_main.hpp"
#include "sim/scenario.hpp"

namespace berth::bench {
namespace {

// Processor time, µs: of the thread, or of the process where a backend has threads of its own.
double us(bool of_process) { return 1e3 * ms_on(of_process ? CLOCK_PROCESS_CPUTIME_ID : CLOCK_THREAD_CPUTIME_ID); }

double quantile(std::vector<double> values, double share) {
  if (values.empty()) return 0;
  const std::size_t at = static_cast<std::size_t>(share * static_cast<double>(values.size() - 1));
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(at), values.end());
  return values[at];
}

// Named times, in the order they first came.
class Table {
 public:
  void add(const std::string& name, double us) {
    if (times_.count(name) == 0) names_.push_back(name);
    times_[name].push_back(us);
  }
  void print() const {
    fmt::print("| | times | median, µs | 10 % | 90 % |\n|---|---|---|---|---|\n");
    for (const std::string& name : names_) {
      const std::vector<double>& times = times_.at(name);
      fmt::print("| {} | {} | {:.1f} | {:.1f} | {:.1f} |\n", name, times.size(), quantile(times, 0.5),
                 quantile(times, 0.1), quantile(times, 0.9));
    }
  }
  double median(const std::string& name) const {
    const auto found = times_.find(name);
    return found == times_.end() ? 0 : quantile(found->second, 0.5);
  }

 private:
  std::vector<std::string> names_;
  std::map<std::string, std::vector<double>> times_;
};

struct Options {
  std::string scenario = "scenarios/track.toml";
  std::string backend = "simd";
  std::string corners = "edges";
  int frames = 240, repeat = 5, full_every = 30;
  bool no_poses = false;
};

void note_stages(const char* prefix, const FrameResult& result, Table& table) {
  for (const StageTime& time : result.times) {
    if (time.stage[0] != '\0') {
      table.add(fmt::format("{}, of it {} (wall)", prefix, time.stage), static_cast<double>(time.ns) / 1e3);
    }
  }
}

int run(int argc, char** argv) {
  Options options;
  CLI::App app("Processor time of frames searched in windows and whole, in turns, over a simulated approach.");
  app.add_option("--scenario", options.scenario, "TOML file")->capture_default_str();
  app.add_option("--backend", options.backend, "")->capture_default_str();
  app.add_option("--corners", options.corners, "edges or photometric")->capture_default_str();
  app.add_option("--frames", options.frames, "frames at the most")->check(CLI::Range(2, 100000));
  app.add_option("--repeat", options.repeat, "runs of the scenario")->check(CLI::Range(1, 10000));
  app.add_option("--full-every", options.full_every, "frames between whole searches")->check(CLI::Range(1, 100000));
  app.add_flag("--no-poses", options.no_poses, "corners alone");
  CLI11_PARSE(app, argc, argv);

  const std::unique_ptr<Source> source = open_scenario(options.scenario);
  std::vector<SourceFrame> frames;
  while (frames.size() < static_cast<std::size_t>(options.frames)) {
    std::optional<SourceFrame> frame = source->next();
    if (!frame) break;
    frames.push_back(std::move(*frame));
  }
  const int width = frames.front().image.width(), height = frames.front().image.height();
  TrackerConfig tracking;
  tracking.full_every = options.full_every;
  DetectorConfig config;
  if (!options.no_poses) {
    config.camera = source->camera();
    config.marker_size_m = 0.1;
  }
  if (options.corners == "photometric") config.corner_method = CornerMethod::photometric;
  const std::unique_ptr<Backend> backend = open_backend(options.backend);
  const bool of_process = options.backend != "simd" && options.backend != "cpu" && options.backend != "reference";
  Detector whole(*backend, width, height, config);
  config.window_sides = tracking_window_sides(width, height, tracking);
  Detector windowed(*backend, width, height, config);

  Table table;
  std::size_t pixels = 0, windows = 0;
  TrackerCounts counts;
  for (int k = 0; k < options.repeat; ++k) {
    Tracker tracker(width, height, tracking);
    for (const SourceFrame& frame : frames) {
      const double start = us(of_process);
      const FrameResult& all = whole.detect(frame.image.view(), frame.stamp);
      const double middle = us(of_process);
      const TrackedFrame& tracked = tracker.look(windowed, frame.image.view(), frame.stamp);
      const double end = us(of_process);
      table.add("whole frame", middle - start);
      table.add(fmt::format("tracked: {}", name_of(tracked.why)), end - middle);
      if (tracked.why == SearchReason::held) {
        note_stages("windows", *tracked.result, table);
        note_stages("whole", all, table);
        for (const SearchWindow& window : tracked.windows)
          pixels += static_cast<std::size_t>(window.side * window.side);
        windows += tracked.windows.size();
      }
    }
    counts = tracker.counts();
  }
  const std::size_t held = counts.by_reason[0];
  fmt::print("{}, {} frames of {} x {}, {} windows and {} bytes on the device\n\n", backend->name(), frames.size(),
             width, height, config.window_sides.size(), windowed.device_bytes());
  table.print();
  if (held == 0) return 0;
  const double runs = static_cast<double>(held) * options.repeat;
  fmt::print("\n{:.2f} windows and {:.1f} % of the pixels a frame in windows; {:.2f} x as fast as whole\n",
             static_cast<double>(windows) / runs, 100.0 * static_cast<double>(pixels) / runs / (width * height),
             table.median("whole frame") / table.median("tracked: held"));
  return 0;
}

}  // namespace
}  // namespace berth::bench

int main(int argc, char** argv) { return berth::bench::run_main("tracked_frame", berth::bench::run, argc, argv); }
