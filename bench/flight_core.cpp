// The flight core over many frames: what it takes, how deep its stack gets, what its slowest frames cost.
#include <fmt/core.h>
#include <pthread.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <cstring>
#include <memory>
#include <string>
#include <vector>

#include "berth/camera.hpp"
#include "berth/error.hpp"
#include "berth_core.h"
#include "clock.hpp"
#include "run_main.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"
#include "support/counted_allocations.hpp"
#include "support/pictures.hpp"

namespace berth::bench {
namespace {

constexpr int kWidth = 640, kHeight = 480;
constexpr std::size_t kStackBytes = std::size_t{4} << 20;
constexpr u8 kPaint = 0xa7;

struct Options {
  std::size_t frames = 100000;
  std::string corners = "edges";
  int full_every = 0;
};

struct Picture {
  std::string name;
  GrayImage image;
};

struct Free {
  void operator()(void* memory) const { std::free(memory); }
};

std::vector<Picture> pictures_of_the_dock() {
  std::vector<Picture> pictures;
  for (int i = 0; i < 100; i += 5) {
    const sim::Scene scene = sim::corpus_scene("dock", i, kWidth, kHeight);
    pictures.push_back({fmt::format("dock {}", i), sim::Renderer(scene.camera).render(scene)});
  }
  return pictures;
}

std::vector<Picture> pictures_that_hurt() {
  std::vector<u8> levels;
  for (int level = 0; level < 256; ++level) levels.push_back(static_cast<u8>(level));
  return {{"noise, all levels", pictures::noise(kWidth, kHeight, levels, 1)},
          {"noise, two levels", pictures::noise(kWidth, kHeight, {40, 200}, 2)},
          {"checkerboard, 2 px", pictures::checkerboard(kWidth, kHeight, 2)},
          {"checkerboard, 8 px", pictures::checkerboard(kWidth, kHeight, 8)},
          {"checkerboard, 10 px", pictures::checkerboard(kWidth, kHeight, 10)},
          {"800 squares without a code", pictures::hollow_squares(kWidth, kHeight, 800)},
          {"mazes", pictures::mazes(kWidth, kHeight, 3)},
          {"2,000 quadrilaterals", pictures::quads(kWidth, kHeight, 2000, 4, 4)}};
}

struct Run {
  berth_detector* detector;
  const std::vector<Picture>* pictures;
  std::size_t frames;
  std::vector<double> ms;  // the least of each picture's
  std::size_t failures = 0;
};

void* look(void* argument) {
  Run& run = *static_cast<Run*>(argument);
  for (std::size_t i = 0; i < run.frames; ++i) {
    const std::size_t at = i % run.pictures->size();
    berth_stamp stamp{};
    stamp.struct_size = sizeof stamp;
    stamp.sequence = i;
    stamp.mid_exposure_ns = static_cast<std::int64_t>(i) * 10000000;
    const double start = ms_on(CLOCK_THREAD_CPUTIME_ID);
    if (berth_detector_detect(run.detector, (*run.pictures)[at].image.view().data, kWidth, &stamp, nullptr) != BERTH_OK)
      ++run.failures;
    run.ms[at] = std::min(run.ms[at], ms_on(CLOCK_THREAD_CPUTIME_ID) - start);
  }
  return nullptr;
}

/// Runs on a stack of its own; returns how many bytes of it were written to.
std::size_t on_painted_stack(Run& run) {
  const std::unique_ptr<u8, Free> stack(static_cast<u8*>(std::aligned_alloc(4096, kStackBytes)));
  std::memset(stack.get(), kPaint, kStackBytes);
  pthread_attr_t attributes;
  pthread_attr_init(&attributes);
  pthread_attr_setstack(&attributes, stack.get(), kStackBytes);
  pthread_t thread;
  if (pthread_create(&thread, &attributes, look, &run) != 0) throw Error("no thread could be made");
  pthread_join(thread, nullptr);
  pthread_attr_destroy(&attributes);
  const u8* const end = stack.get() + kStackBytes;
  return static_cast<std::size_t>(
      end - std::find_if(static_cast<const u8*>(stack.get()), end, [](u8 byte) { return byte != kPaint; }));
}

int run(int argc, char** argv) {
  Options options;
  CLI::App app(
      "The flight core (docs/flight-core.md): memory, stack, allocations, slowest frames. Processor ms a frame.");
  app.add_option("--frames", options.frames, "Frames in all")->check(CLI::PositiveNumber)->capture_default_str();
  app.add_option("--corners", options.corners, "How corners are had")
      ->check(CLI::IsMember({"edges", "photometric"}))
      ->capture_default_str();
  app.add_option("--full-every", options.full_every, "Follow markers in windows; 0: the whole frame always")
      ->check(CLI::NonNegativeNumber)
      ->capture_default_str();
  CLI11_PARSE(app, argc, argv);

  std::vector<Picture> pictures = pictures_of_the_dock();
  const std::size_t ordinary = pictures.size();
  for (Picture& picture : pictures_that_hurt()) pictures.push_back(std::move(picture));

  berth_error error{};
  berth_camera camera{};
  camera.struct_size = sizeof camera;
  berth_camera_paper(&camera, kWidth, kHeight, &error);
  berth_core_settings settings{};
  settings.struct_size = sizeof settings;
  settings.width = kWidth;
  settings.height = kHeight;
  settings.camera = &camera;
  settings.marker_size_m = 0.1;
  settings.corner_method = options.corners == "edges" ? BERTH_CORNERS_EDGES : BERTH_CORNERS_PHOTOMETRIC;
  settings.full_every = options.full_every;
  const std::size_t bytes = berth_core_memory_needed(&settings, &error);
  if (bytes == 0) throw Error(error.message);
  const std::size_t rounded = (bytes + BERTH_CORE_ALIGNMENT - 1) / BERTH_CORE_ALIGNMENT * BERTH_CORE_ALIGNMENT;
  const std::unique_ptr<void, Free> memory(std::aligned_alloc(BERTH_CORE_ALIGNMENT, rounded));
  berth_detector* const detector = berth_core_open(&settings, memory.get(), bytes, &error);
  if (detector == nullptr) throw Error(error.message);

  Run run{detector, &pictures, options.frames, std::vector<double>(pictures.size(), 1e9)};
  const std::size_t before = test::allocations();
  look(&run);
  const std::size_t allocations = test::allocations() - before;
  Run on_stack{detector, &pictures, pictures.size(), std::vector<double>(pictures.size(), 1e9)};
  const std::size_t stack = on_painted_stack(on_stack);
  berth_detector_close(detector);

  std::vector<double> usual(run.ms.begin(), run.ms.begin() + static_cast<std::ptrdiff_t>(ordinary));
  std::nth_element(usual.begin(), usual.begin() + static_cast<std::ptrdiff_t>(ordinary / 2), usual.end());
  const double median = usual[ordinary / 2];
  fmt::print("{} x {}, corners by {}, {}\n", kWidth, kHeight, options.corners,
             options.full_every > 0 ? "in windows" : "whole frames");
  fmt::print("memory                    {:>12} bytes, to the last one\n", bytes);
  fmt::print("stack                     {:>12} bytes at the deepest\n", stack);
  fmt::print("frames                    {:>12}\n", run.frames);
  fmt::print("allocations               {:>12}\n", allocations);
  fmt::print("failures                  {:>12}\n", run.failures);
  fmt::print("median frame of the dock  {:>12.3f} ms\n", median);
  for (std::size_t i = ordinary; i < pictures.size(); ++i) {
    fmt::print("{:<26}{:>12.3f} ms, {:.1f} times that\n", pictures[i].name, run.ms[i], run.ms[i] / median);
  }
  return allocations == 0 && run.failures == 0 ? 0 : 1;
}

}  // namespace
}  // namespace berth::bench

int main(int argc, char** argv) { return berth::bench::run_main("flight_core", berth::bench::run, argc, argv); }
