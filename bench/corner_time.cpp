// What better corners cost: µs of processor time a marker for the photometric fit, beside what libapriltag's
// refine_edges adds to its detection of the same frame.
#include <apriltag/apriltag.h>
#include <apriltag/tag36h11.h>
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <memory>
#include <vector>

#include "berth/backend.hpp"
#include "berth/detector.hpp"
#include "clock.hpp"
#include "run_main.hpp"
#include "sim/close_up.hpp"
#include "sim/render.hpp"
#include "target/photometric_fit.hpp"

namespace berth::bench {
namespace {

// Processor time, µs.
double us() { return 1e3 * ms_on(CLOCK_THREAD_CPUTIME_ID); }

// One frame of one marker, and the least that each way took on it.
class Frame {
 public:
  Frame(Backend& backend, const sim::CloseUp& what, int index)
      : scene_(sim::close_up_scene(paper_camera(), what, index)),
        image_(sim::Renderer(scene_.camera, 4).render(scene_)),
        fit_(scene_.camera, scene_.camera.width, scene_.camera.height) {
    Detector detector(backend, scene_.camera.width, scene_.camera.height, {});
    const auto& found = detector.detect(image_.view()).detections;
    if (!found.empty()) detection_ = found.front();
  }
  bool is_found() const { return detection_.family != nullptr; }

  void time_fit() {
    Corners corners = detection_.corners;
    CornerCovariance known;
    CornerFit fit;
    const double start = us();
    fit_.refine(image_.view(), *detection_.family, detection_.id, corners, known, fit);
    fit_us_ = std::min(fit_us_, us() - start);
  }
  void time_apriltag(apriltag_detector_t* detector, bool refine) {
    const View2D<const u8> view = image_.view();
    // The library takes no const image and does not write to it.
    image_u8_t image = {view.width, view.height, view.stride, const_cast<u8*>(view.data)};
    detector->refine_edges = refine;
    const double start = us();
    zarray_t* const detections = apriltag_detector_detect(detector, &image);
    double& least = refine ? refined_us_ : plain_us_;
    least = std::min(least, us() - start);
    apriltag_detections_destroy(detections);
  }
  double fit_us() const { return fit_us_; }
  double apriltag_us() const { return refined_us_ - plain_us_; }

 private:
  sim::Scene scene_;
  GrayImage image_;
  PhotometricFit fit_;
  Detection detection_;
  double fit_us_ = 1e9, plain_us_ = 1e9, refined_us_ = 1e9;
};

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

int run(int argc, char** argv) {
  int frames = 15, repeat = 41;
  std::vector<double> sides = {20, 40, 100, 160};
  CLI::App app("Processor time of better corners, µs a marker: the least of a frame's runs, the median over frames.");
  app.add_option("--frames", frames, "frames a size")->check(CLI::Range(1, 1000));
  app.add_option("--repeat", repeat, "runs a frame, ways taking turns")->check(CLI::Range(1, 100000));
  app.add_option("--sides", sides, "sides of the marker, px")->delimiter(',')->check(CLI::Range(12, 400));
  CLI11_PARSE(app, argc, argv);
  const std::unique_ptr<Backend> backend = open_backend("simd");
  apriltag_family_t* const family = tag36h11_create();
  apriltag_detector_t* const apriltag = apriltag_detector_create();
  apriltag_detector_add_family(apriltag, family);
  apriltag->quad_decimate = 1;
  apriltag->nthreads = 1;
  fmt::print("| side, px | photometric fit, µs | refine_edges, µs |\n|---|---|---|\n");
  for (const double side : sides) {
    std::vector<double> fit, refine;
    for (int i = 0; i < frames; ++i) {
      Frame frame(*backend, {side, 2}, i);
      if (!frame.is_found()) continue;
      for (int k = 0; k < repeat; ++k) {
        frame.time_fit();
        frame.time_apriltag(apriltag, false);
        frame.time_apriltag(apriltag, true);
      }
      fit.push_back(frame.fit_us());
      refine.push_back(frame.apriltag_us());
    }
    if (fit.empty()) continue;
    fmt::print("| {} | {:.1f} | {:.1f} |\n", side, median(fit), median(refine));
    std::fflush(stdout);
  }
  apriltag_detector_destroy(apriltag);
  tag36h11_destroy(family);
  return 0;
}

}  // namespace
}  // namespace berth::bench

int main(int argc, char** argv) { return berth::bench::run_main("corner_time", berth::bench::run, argc, argv); }
