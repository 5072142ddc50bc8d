// What better corners and a pose cost: µs of processor time a marker for the photometric fit and for both poses of a
// marker's plane, beside what libapriltag's refine_edges adds to its detection of the same frame and its
// estimate_tag_pose.
#include <apriltag/apriltag.h>
#include <apriltag/apriltag_pose.h>
#include <apriltag/tag36h11.h>
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdlib>
#include <memory>
#include <vector>

#include "berth/backend.hpp"
#include "berth/detector.hpp"
#include "clock.hpp"
#include "run_main.hpp"
#include "sim/close_up.hpp"
#include "sim/render.hpp"
#include "target/marker_pose.hpp"
#include "target/photometric_fit.hpp"

namespace berth::bench {
namespace {

// Processor time, µs.
double us() { return 1e3 * ms_on(CLOCK_THREAD_CPUTIME_ID); }

constexpr double kSize_m = 0.08;

/// The least that it took, µs.
class Least {
 public:
  template <class Work>
  void time(const Work& work) {
    const double start = us();
    work();
    us_ = std::min(us_, us() - start);
  }
  double value() const { return us_; }

 private:
  double us_ = 1e9;
};

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

  void time_berth() {
    Corners corners;
    CornerCovariance known;
    CornerFit fit;
    const auto refine = [&] {
      corners = detection_.corners;
      fit_.refine(image_.view(), *detection_.family, detection_.id, corners, known, fit);
    };
    cold_fit.time(refine);  // libapriltag ran since the last
    warm_fit.time(refine);
    Pose found;
    PoseUncertainty uncertainty;
    pose.time([&] { marker_pose(scene_.camera, kSize_m, corners, known, found, uncertainty); });
  }
  void time_apriltag(apriltag_detector_t* detector, bool refine) {
    const View2D<const u8> view = image_.view();
    // The library takes no const image and does not write to it.
    image_u8_t image = {view.width, view.height, view.stride, const_cast<u8*>(view.data)};
    detector->refine_edges = refine;
    zarray_t* detections = nullptr;
    (refine ? refined_ : plain_).time([&] { detections = apriltag_detector_detect(detector, &image); });
    if (refine && zarray_size(detections) > 0) time_apriltag_pose(detections);
    apriltag_detections_destroy(detections);
  }
  double refine_edges_us() const { return refined_.value() - plain_.value(); }

  Least cold_fit, warm_fit, pose, apriltag_pose;

 private:
  void time_apriltag_pose(zarray_t* detections) {
    apriltag_detection_t* detection = nullptr;
    zarray_get(detections, 0, &detection);
    const CameraModel& camera = scene_.camera;
    apriltag_detection_info_t info = {detection, kSize_m, camera.fx, camera.fy, camera.cx, camera.cy};
    apriltag_pose_t found;
    apriltag_pose.time([&] { estimate_tag_pose(&info, &found); });
    // matd_destroy is not in Debian's shared library; matrices are single blocks.
    std::free(found.R);
    std::free(found.t);
  }

  sim::Scene scene_;
  GrayImage image_;
  PhotometricFit fit_;
  Detection detection_;
  Least plain_, refined_;
};

double median(std::vector<double> values) {
  std::nth_element(values.begin(), values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2), values.end());
  return values[values.size() / 2];
}

int run(int argc, char** argv) {
  int frames = 15, repeat = 41;
  std::vector<double> sides = {20, 40, 100, 160};
  CLI::App app(
      "Processor time of better corners and of poses, µs a marker: the least of a frame's runs, the median over "
      "frames.");
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
  fmt::print(
      "| side, px | photometric fit, µs | the same, cold | refine_edges | both poses | estimate_tag_pose |\n"
      "|---|---|---|---|---|---|\n");
  for (const double side : sides) {
    std::vector<double> warm, cold, refine, pose, apriltag_pose;
    for (int i = 0; i < frames; ++i) {
      Frame frame(*backend, {side, 2}, i);
      if (!frame.is_found()) continue;
      for (int k = 0; k < repeat; ++k) {
        frame.time_berth();
        frame.time_apriltag(apriltag, false);
        frame.time_apriltag(apriltag, true);
      }
      warm.push_back(frame.warm_fit.value());
      cold.push_back(frame.cold_fit.value());
      refine.push_back(frame.refine_edges_us());
      pose.push_back(frame.pose.value());
      apriltag_pose.push_back(frame.apriltag_pose.value());
    }
    if (warm.empty()) continue;
    fmt::print("| {} | {:.1f} | {:.1f} | {:.1f} | {:.1f} | {:.1f} |\n", side, median(warm), median(cold),
               median(refine), median(pose), median(apriltag_pose));
    std::fflush(stdout);
  }
  apriltag_detector_destroy(apriltag);
  tag36h11_destroy(family);
  return 0;
}

}  // namespace
}  // namespace berth::bench

int main(int argc, char** argv) { return berth::bench::run_main("corner_time", berth::bench::run, argc, argv); }
