// Berth beside libapriltag and OpenCV's ArUco on the same frames in the same run: recall, false positives, corner error
// and processor time. Frames are the simulator's corpora, or given pictures (then only counts and times).
#include <fmt/core.h>
#include <unistd.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <filesystem>
#include <opencv2/imgcodecs.hpp>
#include <opencv2/imgproc.hpp>
#include <set>

#include "berth/error.hpp"
#include "clock.hpp"
#include "engines.hpp"
#include "run_main.hpp"
#include "score.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"

namespace berth::bench {
namespace {

struct Options {
  std::vector<std::string> corpora = sim::corpus_names();
  std::vector<std::string> engines = {"simd",        "apriltag-d1",       "apriltag-d1-tuned",
                                      "apriltag-d2", "apriltag-d2-tuned", "aruco"};
  std::string images;
  int frames = sim::kCorpusFrames;
  int width = 640;
  int height = 480;
  int repeat = 3;
  int threads = 1;
};

struct Frame {
  GrayImage image;
  std::vector<TruthMarker> truth;
};

std::vector<Frame> render_corpus(const std::string& name, const Options& options) {
  std::vector<Frame> frames;
  std::unique_ptr<sim::Renderer> renderer;
  for (int i = 0; i < options.frames; ++i) {
    if (isatty(2) != 0) fmt::print(stderr, "\rrendering {} {}/{} ", name, i + 1, options.frames);
    const sim::Scene scene = sim::corpus_scene(name, i, options.width, options.height);
    if (!renderer) renderer = std::make_unique<sim::Renderer>(scene.camera);
    frames.push_back({renderer->render(scene), sim::truth(scene)});
  }
  if (isatty(2) != 0) fmt::print(stderr, "\r{:40}\r", "");
  return frames;
}

/// Pictures of a folder, scaled to the asked size by area.
std::vector<Frame> read_pictures(const Options& options) {
  std::set<std::string> paths;
  for (const auto& entry : std::filesystem::directory_iterator(options.images)) {
    const std::string extension = entry.path().extension().string();
    if (extension == ".jpg" || extension == ".png" || extension == ".pgm") paths.insert(entry.path().string());
  }
  std::vector<Frame> frames;
  for (const std::string& path : paths) {
    cv::Mat picture = cv::imread(path, cv::IMREAD_GRAYSCALE);
    if (picture.empty()) throw Error(path + ": cannot be read as a picture");
    cv::Mat scaled;
    cv::resize(picture, scaled, cv::Size(options.width, options.height), 0, 0, cv::INTER_AREA);
    Frame frame{GrayImage(options.width, options.height), {}};
    for (int y = 0; y < options.height; ++y) {
      std::copy(scaled.ptr(y), scaled.ptr(y) + options.width, frame.image.view().row(y));
    }
    frames.push_back(std::move(frame));
  }
  if (frames.empty()) throw Error(options.images + ": no .jpg, .png or .pgm in this folder");
  return frames;
}

double quantile(std::vector<double> values, double share) {
  std::sort(values.begin(), values.end());
  return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1) + 0.5)];
}

struct Result {
  std::string engine;
  Score score;
  int found = 0;
  std::vector<double> ms;       // processor time of all threads
  std::vector<double> wall_ms;  // by the clock on the wall
};

/// Engines take turns on each frame; the best of `repeat` counts, so that what else the machine does weighs less.
std::vector<Result> compare(const std::vector<Frame>& frames, const Options& options) {
  std::vector<std::unique_ptr<Engine>> engines;
  std::vector<Result> results;
  for (const std::string& name : options.engines) {
    engines.push_back(make_engine(name, options.threads));
    engines.back()->run(frames.front().image.view());
    results.push_back({name, {}, 0, {}, {}});
  }
  for (const Frame& frame : frames) {
    std::vector<double> best(engines.size(), 1e9);
    std::vector<double> best_wall(engines.size(), 1e9);
    for (int round = 0; round < options.repeat; ++round) {
      for (std::size_t i = 0; i < engines.size(); ++i) {
        const double wall = ms_on(CLOCK_MONOTONIC);
        const double processor = ms_on(CLOCK_PROCESS_CPUTIME_ID);
        engines[i]->run(frame.image.view());
        best[i] = std::min(best[i], ms_on(CLOCK_PROCESS_CPUTIME_ID) - processor);
        best_wall[i] = std::min(best_wall[i], ms_on(CLOCK_MONOTONIC) - wall);
      }
    }
    for (std::size_t i = 0; i < engines.size(); ++i) {
      const std::vector<Found> found = engines[i]->found();
      results[i].score.add(frame.truth, found);
      results[i].found += static_cast<int>(found.size());
      results[i].ms.push_back(best[i]);
      results[i].wall_ms.push_back(best_wall[i]);
    }
  }
  return results;
}

void print_table(const std::string& title, const std::vector<Frame>& frames, const std::vector<Result>& results,
                 bool has_truth) {
  const double base = quantile(results.front().ms, 0.5);
  fmt::print("\n**{}**, {} frames of {}×{}\n\n", title, frames.size(), frames.front().image.width(),
             frames.front().image.height());
  if (has_truth) {
    fmt::print(
        "| engine | recall % | of | partly seen | false | corner RMS px | ms median | ms p95 | frames/s | time against "
        "{} |\n",
        results.front().engine);
    fmt::print("|---|---|---|---|---|---|---|---|---|---|\n");
  } else {
    fmt::print("| engine | found | ms median | ms p95 | frames/s | time against {} |\n|---|---|---|---|---|---|\n",
               results.front().engine);
  }
  for (const Result& r : results) {
    const double median = quantile(r.ms, 0.5);
    const std::string times = fmt::format("{:.3f} | {:.3f} | {:.0f} | {:.1f} |\n", median, quantile(r.ms, 0.95),
                                          1e3 / quantile(r.wall_ms, 0.5), median / base);
    if (has_truth) {
      fmt::print("| {} | {:.1f} | {} | {} | {} | {:.4f} | {}", r.engine, 100 * r.score.recall(), r.score.required,
                 r.score.extra, r.score.false_positives, r.score.corner_rms_px(), times);
    } else {
      fmt::print("| {} | {} | {}", r.engine, r.found, times);
    }
  }
  std::fflush(stdout);
}

int run(int argc, char** argv) {
  Options options;
  CLI::App app("Berth beside libapriltag and OpenCV's ArUco: same frames, same run. Times are processor ms a frame.");
  app.add_option("--corpora", options.corpora, "corpora to render (default: all)")->delimiter(',');
  app.add_option("--images", options.images, "a folder of pictures instead, scaled to --width x --height");
  app.add_option("--engines", options.engines,
                 "first is the base of the ratios: simd, cpu, opencl, reference, apriltag-d1, apriltag-d1-tuned, "
                 "apriltag-d2, apriltag-d2-tuned, aruco")
      ->delimiter(',');
  app.add_option("--frames", options.frames, "frames a corpus")->check(CLI::Range(1, 100000));
  app.add_option("--width", options.width, "px")->check(CLI::Range(240, 16384));
  app.add_option("--height", options.height, "px")->check(CLI::Range(180, 16384));
  app.add_option("--repeat", options.repeat, "runs a frame; the best counts")->check(CLI::Range(1, 1000));
  app.add_option("--threads", options.threads, "threads of Berth's CPU backends")->check(CLI::Range(0, 256));
  CLI11_PARSE(app, argc, argv);
  if (!options.images.empty()) {
    const std::vector<Frame> frames = read_pictures(options);
    print_table(options.images, frames, compare(frames, options), false);
    return 0;
  }
  for (const std::string& name : options.corpora) {
    const std::vector<Frame> frames = render_corpus(name, options);
    print_table(name, frames, compare(frames, options), true);
  }
  return 0;
}

}  // namespace
}  // namespace berth::bench

int main(int argc, char** argv) { return berth::bench::run_main("compare_apriltag", berth::bench::run, argc, argv); }
