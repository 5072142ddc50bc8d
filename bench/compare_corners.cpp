// Corners of Berth's two grades, libapriltag and OpenCV on the same frames in the same run, beside the Cramér-Rao
// bound: 2-D RMS px against the simulator's truth.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <functional>

#include "berth/backend.hpp"
#include "berth/detector.hpp"
#include "clock.hpp"
#include "engines.hpp"
#include "exact_math.hpp"
#include "run_main.hpp"
#include "score.hpp"
#include "sim/close_up.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"
#include "table/corner_bound.hpp"
#include "target/photometric_fit.hpp"

namespace berth::bench {
namespace {

struct Options {
  int frames = 60;
  bool corpora = false;
};

struct Case {
  std::string name;
  std::function<sim::Scene(int)> scene;
  /// The bound is that of a model which holds: Gaussian blur, straight tones, nothing saturated.
  bool has_bound = true;
  int fineness = 4;
};

Case close_up(const std::string& name, const sim::CloseUp& what,
              const std::function<void(sim::Scene&, int)>& change = {}, bool has_bound = false) {
  return {name,
          [=](int i) {
            sim::Scene scene = sim::close_up_scene(paper_camera(), what, i);
            if (change) change(scene, i);
            return scene;
          },
          has_bound || !change};
}

std::vector<Case> cases() {
  const sim::CloseUp usual{80, 2};
  sim::CloseUp border = usual, steep = usual;
  border.at_border = true;
  steep.most_tilt_deg = 60;
  const auto motion = [](double px) {
    return [px](sim::Scene& s, int i) {
      const double shift = px * s.markers[0].pose.t[2] / s.camera.fx;
      s.motion.shift = {shift * sim::exact_cos(i), shift * sim::exact_sin(i), 0};
    };
  };
  const auto disc = [](double px) { return [px](sim::Scene& s, int) { s.sensor.defocus_px = px; }; };
  const auto gamma = [](double g) { return [g](sim::Scene& s, int) { s.sensor.gamma = g; }; };
  const auto white = [](double level) { return [level](sim::Scene& s, int) { s.sensor.white_level = level; }; };
  const auto blur = [](double px) { return [px](sim::Scene& s, int) { s.sensor.blur_sigma_px = px; }; };
  std::vector<Case> all = {
      close_up("20 px, noise 2", {20, 2}),
      close_up("40 px, noise 2", {40, 2}),
      close_up("80 px, noise 2", usual),
      close_up("80 px, noise 8", {80, 8}),
      close_up("160 px, noise 2", {160, 2}),
      close_up("80/2 at the border", border),
      close_up("80/2 tilted to 60°", steep),
      close_up("80/2, blur 0.3 px", usual, blur(0.3), true),
      close_up("80/2, blur 1.5 px", usual, blur(1.5), true),
      close_up("80/2, disc of radius 2", usual, disc(2)),
      close_up("80/2, motion 2 px", usual, motion(2)),
      close_up("80/2, motion 4 px", usual, motion(4)),
      close_up("80/2, gamma 0.45", usual, gamma(0.45)),
      close_up("80/2, gamma 1.7", usual, gamma(1.7)),
      close_up("80/2, white at 290", usual, white(330)),
      close_up("80/2, white at 440", usual, white(500)),
  };
  all.push_back(all[0]);
  all.back().name = "20/2, blur at whole pixels";
  all.back().fineness = 1;
  all.back().has_bound = false;
  return all;
}

struct Row {
  Score edges, fit, apriltag, opencv;
  double bound_squares = 0, fit_ms = 0;
  int frames = 0, markers = 0, fitted = 0;
};

class Bench {
 public:
  Bench() : backend_(open_backend("simd")), apriltag_(make_apriltag(1, 20)), opencv_(make_opencv_aruco()) {}

  void add(const sim::Scene& scene, const GrayImage& image, bool has_bound, Row& row) {
    const std::vector<TruthMarker> truth = sim::truth(scene);
    const CameraModel& camera = scene.camera;
    Detector detector(*backend_, camera.width, camera.height, {});
    PhotometricFit fit(camera, camera.width, camera.height);
    std::vector<Found> edges, photometric;
    for (const Detection& d : detector.detect(image.view()).detections) {
      edges.push_back({d.id, d.corners});
      Corners corners = d.corners;
      CornerCovariance known;
      CornerFit how;
      const double start = ms_on(CLOCK_THREAD_CPUTIME_ID);
      row.fitted += fit.refine(image.view(), *d.family, d.id, corners, known, how) ? 1 : 0;
      row.fit_ms += ms_on(CLOCK_THREAD_CPUTIME_ID) - start;
      ++row.markers;
      photometric.push_back({d.id, corners});
    }
    row.edges.add(truth, edges);
    row.fit.add(truth, photometric);
    apriltag_->run(image.view());
    row.apriltag.add(truth, apriltag_->found());
    opencv_->run(image.view());
    row.opencv.add(truth, opencv_->found());
    if (has_bound) {
      const double bound = table::corner_bound_px(table::corner_information(scene)).value();
      row.bound_squares += bound * bound;
    }
    ++row.frames;
  }

 private:
  std::unique_ptr<Backend> backend_;
  std::unique_ptr<Engine> apriltag_, opencv_;
};

void print_head() {
  fmt::print(
      "| | bound | photometric | edges | libapriltag | OpenCV | fitted of | µs a marker |\n"
      "|---|---|---|---|---|---|---|---|\n");
}

void print_row(const std::string& name, bool has_bound, const Row& row) {
  const auto rms = [](const Score& score) {
    return score.corners > 0 ? fmt::format("{:.4f}", score.corner_rms_px()) : std::string("none found");
  };
  fmt::print("| {} | {} | {} | {} | {} | {} | {} of {} | {:.0f} |\n", name,
             has_bound ? fmt::format("{:.4f}", std::sqrt(row.bound_squares / row.frames)) : "", rms(row.fit),
             rms(row.edges), rms(row.apriltag), rms(row.opencv), row.fitted, row.markers,
             1e3 * row.fit_ms / std::max(1, row.markers));
  std::fflush(stdout);
}

int run(int argc, char** argv) {
  Options options;
  CLI::App app("Corner error, 2-D RMS px, paper's lens at 640 x 480. µs: processor time of the photometric fit alone.");
  app.add_option("--frames", options.frames, "frames a row")->check(CLI::Range(1, 100000));
  app.add_flag("--corpora", options.corpora, "the corpora too");
  CLI11_PARSE(app, argc, argv);
  Bench bench;
  print_head();
  for (const Case& one : cases()) {
    Row row;
    for (int i = 0; i < options.frames; ++i) {
      const sim::Scene scene = one.scene(i);
      bench.add(scene, sim::Renderer(scene.camera, one.fineness).render(scene), one.has_bound, row);
    }
    print_row(one.name, one.has_bound, row);
  }
  if (!options.corpora) return 0;
  for (const std::string& name : sim::corpus_names()) {
    Row row;
    std::unique_ptr<sim::Renderer> renderer;
    for (int i = 0; i < options.frames; ++i) {
      const sim::Scene scene = sim::corpus_scene(name, i, 640, 480);
      if (!renderer) renderer = std::make_unique<sim::Renderer>(scene.camera);
      bench.add(scene, renderer->render(scene), false, row);
    }
    print_row("corpus " + name, false, row);
  }
  return 0;
}

}  // namespace
}  // namespace berth::bench

int main(int argc, char** argv) { return berth::bench::run_main("compare_corners", berth::bench::run, argc, argv); }
