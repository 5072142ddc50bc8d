// What a network costs on a backend: wall time of one window or a whole frame, and of every step. For comparing with
// other engines in one run, bench/compare_networks.py calls it in turns with them.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "berth/backend.hpp"
#include "berth/error.hpp"
#include "clock.hpp"
#include "navigation/network_plan.hpp"
#include "run_main.hpp"

namespace berth::bench {
namespace {

struct Options {
  std::string network;
  std::string backend = "simd";
  BackendOptions device;
  int width = 256, height = 256, windows = 1, runs = 50;
  bool steps = false;
};

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

/// A plan over windows of noise, at full size in the middle of one frame.
class Subject {
 public:
  Subject(const Options& options, const Network& network)
      : backend_(open_backend(options.backend, options.device)),
        device_(*backend_, network),
        frame_(backend_->make_buffer(static_cast<std::size_t>(options.width * options.height))),
        plan_(device_, {frame_.get(), options.width, options.height, options.width}, options.windows, options.width,
              options.height),
        stream_(backend_->make_stream()),
        sums_(plan_.sums().bytes() / 4) {
    std::vector<u8> pixels(frame_->bytes());
    u32 state = 1;
    for (u8& pixel : pixels) pixel = static_cast<u8>((state = state * 1664525u + 1013904223u) >> 24);
    upload_at_start(*backend_, *stream_, *frame_, pixels.data(), pixels.size());
    std::vector<s32> windows;
    for (int k = 0; k < options.windows; ++k) windows.insert(windows.end(), {0, 0, 256, 0});
    upload_at_start(*backend_, *stream_, plan_.windows(), windows.data(), windows.size() * 4);
  }

  /// ms by a clock from enqueueing to the sums on the host.
  double run(clockid_t clock) {
    const double start = ms_on(clock);
    stream_->replay(plan_.plan());
    stream_->download(plan_.sums(), sums_.data(), plan_.sums().bytes());
    if (!stream_->finish()) throw Error("the device was lost");
    return ms_on(clock) - start;
  }
  std::vector<std::int64_t> time_steps() { return stream_->time_steps(plan_.plan()); }
  const std::vector<Step>& steps() const { return plan_.steps(); }
  Backend& backend() { return *backend_; }

 private:
  std::unique_ptr<Backend> backend_;
  DeviceNetwork device_;
  std::unique_ptr<Buffer> frame_;
  NetworkPlan plan_;
  std::unique_ptr<Stream> stream_;
  std::vector<s32> sums_;
};

int run(int argc, char** argv) {
  Options options;
  CLI::App app(
      "Wall time of a network on a backend, ms: the median and the least of its runs; then the median of as many runs' "
      "processor time.");
  app.add_option("network", options.network, "the network's file (.berthnet)")->required();
  app.add_option("--backend", options.backend)->capture_default_str();
  app.add_option("--threads", options.device.threads, "of the CPU backends, 0 for every core")->capture_default_str();
  app.add_option("--width", options.width, "of a window, px; larger than the network's side: a search")
      ->capture_default_str();
  app.add_option("--height", options.height, "px")->capture_default_str();
  app.add_option("--windows", options.windows, "in a launch")->check(CLI::Range(1, 1024))->capture_default_str();
  app.add_option("--runs", options.runs)->check(CLI::Range(1, 1000000))->capture_default_str();
  app.add_flag("--steps", options.steps, "each step's least, us, where the backend can tell");
  CLI11_PARSE(app, argc, argv);

  const Network network = read_network(options.network);
  Subject subject(options, network);
  std::vector<double> wall;
  std::vector<double> processor;  // of all threads: another process in between costs nothing
  for (int i = 0; i < options.runs; ++i) processor.push_back(subject.run(CLOCK_PROCESS_CPUTIME_ID));
  for (int i = 0; i < options.runs; ++i) wall.push_back(subject.run(CLOCK_MONOTONIC));
  fmt::print("{} {:.4f} {:.4f} {:.4f}\n", options.backend, median(wall), *std::min_element(wall.begin(), wall.end()),
             median(processor));
  if (!options.steps) return 0;
  std::vector<std::vector<double>> steps(subject.steps().size());
  for (int i = 0; i < options.runs; ++i) {
    const std::vector<std::int64_t> once = subject.time_steps();
    for (std::size_t k = 0; k < once.size(); ++k) steps[k].push_back(static_cast<double>(once[k]) / 1e3);
  }
  for (std::size_t k = 0; k < steps.size(); ++k) {
    if (!steps[k].empty())
      fmt::print("  {:<20} {:>9.1f}\n", name_of(subject.steps()[k].op),
                 *std::min_element(steps[k].begin(), steps[k].end()));
  }
  return 0;
}

}  // namespace
}  // namespace berth::bench

int main(int argc, char** argv) { return berth::bench::run_main("network_time", berth::bench::run, argc, argv); }
