// Where a docking frame's time goes, operation by operation, on the simulator's corpora; and what the worst pictures
// that anybody could show cost. Processor time of one thread.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <functional>
#include <limits>
#include <map>

#include "berth/detector.hpp"
#include "berth/ops.hpp"
#include "clock.hpp"
#include "frame/marker_plan.hpp"
#include "run_main.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"

namespace berth::bench {
namespace {

struct Options {
  std::string backend = "simd";
  std::vector<std::string> corpora = sim::corpus_names();
  int frames = 30;
  int width = 640;
  int height = 480;
  int repeat = 9;
  int evict_mb = 0;
};

using Frames = std::vector<GrayImage>;

Frames render_corpus(const std::string& name, const Options& options) {
  Frames frames;
  std::unique_ptr<sim::Renderer> renderer;
  for (int i = 0; i < options.frames; ++i) {
    const sim::Scene scene = sim::corpus_scene(name, i, options.width, options.height);
    if (!renderer) renderer = std::make_unique<sim::Renderer>(scene.camera);
    frames.push_back(renderer->render(scene));
  }
  return frames;
}

/// Numbers from 0 to 65535 that look random.
class Dice {
 public:
  int roll() {
    state_ = state_ * 6364136223846793005u + 1442695040888963407u;
    return static_cast<int>(state_ >> 48);
  }

 private:
  u64 state_ = 1;
};

Frames with_noise(const Frames& frames, double sigma) {
  Dice dice;
  Frames noisy;
  for (const GrayImage& frame : frames) {
    const View2D<const u8> from = frame.view();
    GrayImage image(from.width, from.height);
    for (int y = 0; y < from.height; ++y) {
      for (int x = 0; x < from.width; ++x) {
        double sum = -6;  // of twelve numbers up to 1: nearly normal, deviation 1
        for (int i = 0; i < 12; ++i) sum += dice.roll() / 65536.0;
        const double level = from.row(y)[x] + sigma * sum + 0.5;
        image.view().row(y)[x] = static_cast<u8>(std::min(255.0, std::max(0.0, level)));
      }
    }
    noisy.push_back(std::move(image));
  }
  return noisy;
}

Frames drawn(const Options& options, const std::function<int(int, int)>& level) {
  Frames frames;
  frames.emplace_back(options.width, options.height);
  for (int y = 0; y < options.height; ++y) {
    for (int x = 0; x < options.width; ++x) frames.front().view().row(y)[x] = static_cast<u8>(level(x, y));
  }
  return frames;
}

/// Microseconds a frame: means over frames of the least of its runs.
struct Budget {
  double whole = 0, median = 0, host = 0;
  std::map<std::string, double> operations;
};

class Timer {
 public:
  Timer(const Options& options)
      : options_(options),
        memory_(static_cast<std::size_t>(options.evict_mb) << 20),
        backend_(open_backend(options.backend)) {}

  Budget time(const Frames& frames, std::vector<std::string>& order) {
    Detector detector(*backend_, options_.width, options_.height, {});
    MarkerPlan plan(*backend_, options_.width, options_.height, {});
    const std::unique_ptr<Stream> stream = backend_->make_stream();
    std::vector<u8> padded(plan.geometry().frame_bytes());
    Budget budget;
    std::vector<double> wholes;
    const double share = 1.0 / static_cast<double>(frames.size());
    for (const GrayImage& frame : frames) {
      double whole = std::numeric_limits<double>::max();
      double host = whole;
      std::vector<std::int64_t> least;
      pad_frame(frame.view(), plan.geometry(), padded.data());
      stream->upload(plan.frame(), padded.data(), padded.size());
      for (int i = 0; i < options_.repeat; ++i) {
        evict();
        const double start = ms_on(CLOCK_THREAD_CPUTIME_ID);
        const FrameResult& result = detector.detect(frame.view());
        whole = std::min(whole, ms_on(CLOCK_THREAD_CPUTIME_ID) - start);
        host = std::min(host, static_cast<double>(result.times[1].ns) * 1e-3);
        evict();
        const std::vector<std::int64_t> times = stream->time_steps(plan.plan());
        if (least.empty()) least = times;
        for (std::size_t k = 0; k < times.size(); ++k) least[k] = std::min(least[k], times[k]);
      }
      wholes.push_back(whole * 1e3);
      budget.whole += whole * 1e3 * share;
      budget.host += host * share;
      for (std::size_t k = 0; k < least.size(); ++k) {
        const std::string name = name_of(plan.steps()[k].op);
        if (std::find(order.begin(), order.end(), name) == order.end()) order.push_back(name);
        budget.operations[name] += static_cast<double>(least[k]) * 1e-3 * share;
      }
    }
    std::nth_element(wholes.begin(), wholes.begin() + static_cast<std::ptrdiff_t>(wholes.size() / 2), wholes.end());
    budget.median = wholes[wholes.size() / 2];
    return budget;
  }

 private:
  /// Writes over other memory, as other work between two frames does.
  void evict() {
    for (std::size_t i = 0; i < memory_.size(); i += 64) memory_[i] = static_cast<u8>(memory_[i] + 1);
  }

  const Options& options_;
  std::vector<u8> memory_;
  std::unique_ptr<Backend> backend_;
};

void print_row(const std::string& name, const std::vector<Budget>& budgets,
               const std::function<double(const Budget&)>& of) {
  fmt::print("| {} |", name);
  for (const Budget& budget : budgets) fmt::print(" {:.1f} |", of(budget));
  fmt::print("\n");
}

void print_corpora(const Options& options, Timer& timer) {
  std::vector<std::string> order;
  std::vector<Budget> budgets;
  fmt::print("us a frame of {}x{}, means over {} frames of the least of {}\n\n| operation |", options.width,
             options.height, options.frames, options.repeat);
  for (const std::string& name : options.corpora) {
    fmt::print(" {} |", name);
    std::fflush(stdout);
    budgets.push_back(timer.time(render_corpus(name, options), order));
  }
  fmt::print("\n|---|");
  for (std::size_t i = 0; i < budgets.size(); ++i) fmt::print("---|");
  fmt::print("\n");
  for (const std::string& name : order) {
    print_row(name, budgets, [&](const Budget& b) { return b.operations.at(name); });
  }
  print_row("decode (host)", budgets, [](const Budget& b) { return b.host; });
  print_row("**whole frame**", budgets, [](const Budget& b) { return b.whole; });
  print_row("median", budgets, [](const Budget& b) { return b.median; });
}

void print_worst(const Options& options, Timer& timer) {
  std::vector<std::string> order;
  const Frames easy = render_corpus("easy", options);
  const double usual = timer.time(easy, order).median;
  fmt::print("\n| picture | us a frame | times the median of easy |\n|---|---|---|\n");
  const auto row = [&](const std::string& name, const Frames& frames) {
    const double us = timer.time(frames, order).median;
    fmt::print("| {} | {:.0f} | {:.2f} |\n", name, us, us / usual);
    std::fflush(stdout);
  };
  row("easy, noise of 1 grey level added", with_noise(easy, 1));
  row("easy, noise of 8", with_noise(easy, 8));
  Dice dice;
  row("white noise", drawn(options, [&](int, int) { return dice.roll() >> 8; }));
  row("black and white noise", drawn(options, [&](int, int) { return dice.roll() % 2 * 255; }));
  for (const int side : {1, 2, 4, 6, 8, 16}) {
    row(fmt::format("checkerboard of {} px", side),
        drawn(options, [side](int x, int y) { return (x / side + y / side) % 2 * 255; }));
  }
  row("upright lines", drawn(options, [](int x, int) { return x % 2 * 255; }));
  for (const int pitch : {8, 12, 16}) {
    row(fmt::format("dark squares of {} px", pitch - 2),
        drawn(options, [pitch](int x, int y) { return x % pitch > 1 && y % pitch > 1 ? 0 : 255; }));
  }
}

int run(int argc, char** argv) {
  Options options;
  bool worst = false;
  CLI::App app("Where a docking frame's time goes, operation by operation. Processor time of one thread.");
  app.add_option("--backend", options.backend, "whose operations; those of devices are timed by their own clock");
  app.add_option("--corpora", options.corpora, "corpora to render (default: all)")->delimiter(',');
  app.add_option("--frames", options.frames, "frames a corpus")->check(CLI::Range(1, 100000));
  app.add_option("--width", options.width, "px")->check(CLI::Range(240, 16384));
  app.add_option("--height", options.height, "px")->check(CLI::Range(180, 16384));
  app.add_option("--repeat", options.repeat, "runs a frame; the least counts")->check(CLI::Range(1, 1000));
  app.add_option("--evict", options.evict_mb, "MB written between runs, so that the caches are cold")
      ->check(CLI::Range(0, 4096));
  app.add_flag("--worst", worst, "pictures made to be slow, and noise, in place of the corpora");
  CLI11_PARSE(app, argc, argv);
  Timer timer(options);
  worst ? print_worst(options, timer) : print_corpora(options, timer);
  return 0;
}

}  // namespace
}  // namespace berth::bench

int main(int argc, char** argv) { return berth::bench::run_main("frame_time", berth::bench::run, argc, argv); }
