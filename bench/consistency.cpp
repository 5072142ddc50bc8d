// How honest covariances are: errors of corners and poses in units of their own, both grades on the same rendered
// frames.
#include "table/consistency.hpp"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <optional>
#include <vector>

#include "berth/backend.hpp"
#include "berth/detector.hpp"
#include "pose_algebra.hpp"
#include "run_main.hpp"
#include "sim/close_up.hpp"
#include "sim/corpus.hpp"
#include "sim/render.hpp"
#include "sim/scenario.hpp"

namespace berth::bench {
namespace {

struct Options {
  int frames = 100;
  std::string scenario = "scenarios/approach.toml";
  std::vector<std::string> corpora = sim::corpus_names();
  bool corpora_alone = false;
  int fineness = 1;
  bool straight_tones = false;
};

constexpr CornerMethod kGrades[] = {CornerMethod::edges, CornerMethod::photometric};
constexpr const char* kGradeNames[] = {"edges", "photometric"};

/// One row of each grade, over frames of one camera or several.
class Row {
 public:
  Row(Backend& backend, std::string name) : backend_(backend), name_(std::move(name)) {}

  void add(const CameraModel& camera, View2D<const u8> image, const std::vector<TruthMarker>& truth) {
    for (std::size_t grade = 0; grade < 2; ++grade) {
      if (!is_last(camera)) detectors_[grade] = nullptr;
      if (!detectors_[grade]) {
        DetectorConfig config;
        config.camera = camera;
        config.marker_size_m = 1;
        config.corner_method = kGrades[grade];
        detectors_[grade] = std::make_unique<Detector>(backend_, camera.width, camera.height, config);
      }
      for (Detection found : detectors_[grade]->detect(image).detections) {
        for (const TruthMarker& marker : truth) {
          if (marker.id != found.id || marker.family != found.family->name || !is_near(found, marker)) continue;
          scale_pose(marker.size_m, found);
          if (grade == 1 && !found.corner_fit) continue;  // the edges' again
          sums_[grade].add(found, marker);
          if (!found.has_pose) continue;
          const std::array<double, 6> off = step_between(marker.pose, found.pose);
          position_mm_[grade].push_back(1e3 * std::hypot(off[0], off[1], off[2]));
          turn_deg_[grade].push_back(std::hypot(off[3], off[4], off[5]) * 180 / std::acos(-1.0));
        }
      }
    }
    last_ = camera;
  }

  void print() const {
    for (std::size_t grade = 0; grade < 2; ++grade) {
      const table::Consistency& sum = sums_[grade];
      const auto corners = table::honest_bounds(sum.markers(), 8), poses = table::honest_bounds(sum.poses(), 6);
      fmt::print("| {} | {} | {} | {:.4f} | {:.2f} ({:.2f}–{:.2f}) | {:.2f} ({:.2f}–{:.2f}) |", name_,
                 kGradeNames[grade], sum.markers(), sum.corner_rms_px(), sum.corners(), corners[0], corners[1],
                 sum.pose(), poses[0], poses[1]);
      for (std::size_t i = 0; i < 6; ++i) fmt::print("{}{:.2f}", i == 0 ? " " : ", ", sum.axis(i));
      fmt::print(" | {:.1f} | {} | {:.4f} | {:.4f} |\n", 100 * sum.outside(), sum.ambiguous(),
                 median(position_mm_[grade]), median(turn_deg_[grade]));
    }
    std::fflush(stdout);
  }

 private:
  bool is_last(const CameraModel& camera) const {
    return camera.width == last_.width && camera.height == last_.height && camera.fx == last_.fx &&
           camera.cx == last_.cx && camera.cy == last_.cy;
  }
  /// A misread marker is no measurement: nearer than a quarter of the side, as bench/score.hpp has it.
  static bool is_near(const Detection& found, const TruthMarker& marker) {
    for (std::size_t i = 0; i < 4; ++i) {
      const std::array<double, 2>&a = marker.corners[i], &b = marker.corners[(i + 1) % 4];
      const double side = std::hypot(b[0] - a[0], b[1] - a[1]);
      if (std::hypot(found.corners[i][0] - a[0], found.corners[i][1] - a[1]) > std::max(2.0, side / 4)) return false;
    }
    return true;
  }

  static double median(std::vector<double> values) {
    if (values.empty()) return 0;
    std::sort(values.begin(), values.end());
    return values[values.size() / 2];
  }

  Backend& backend_;
  std::string name_;
  std::array<std::vector<double>, 2> position_mm_, turn_deg_;
  std::array<std::unique_ptr<Detector>, 2> detectors_;
  std::array<table::Consistency, 2> sums_;
  CameraModel last_;
};

int run(int argc, char** argv) {
  Options options;
  CLI::App app(
      "Errors of corners and poses in units of their own covariances, over their degrees of freedom: 1 is "
      "honest. In brackets the 95 % bounds of an honest mean.");
  app.add_option("--frames", options.frames, "frames a row")->check(CLI::Range(1, 100000));
  app.add_option("--scenario", options.scenario, "of the first row");
  CLI::Option* const corpora = app.add_option("--corpora", options.corpora, "these corpora alone, and no other row")
                                   ->delimiter(',')
                                   ->check(CLI::IsMember(sim::corpus_names()));
  app.add_option("--fineness", options.fineness, "of the corpora: points a pixel's side where blur is computed")
      ->check(CLI::Range(1, 8));
  app.add_flag("--straight-tones", options.straight_tones, "the corpora without tone curves and saturation");
  CLI11_PARSE(app, argc, argv);
  options.corpora_alone = corpora->count() > 0;
  const std::unique_ptr<Backend> backend = open_backend("simd");
  fmt::print(
      "| frames | corners by | markers | corner RMS px | corners, mean square | pose, mean square | x, y, z, rx, ry, "
      "rz "
      "| beyond 95 %: % | ambiguous | position, median mm | turn, median ° |\n"
      "|---|---|---|---|---|---|---|---|---|---|---|\n");
  if (!options.corpora_alone) {
    const std::unique_ptr<Source> source = open_scenario(options.scenario);
    Row row(*backend, "approach");
    const std::optional<CameraModel> camera = source->camera();
    while (const std::optional<SourceFrame> frame = source->next()) row.add(*camera, frame->image.view(), frame->truth);
    row.print();
  }
  for (const auto& [side, noise] : {std::array<double, 2>{20, 2}, {40, 2}, {80, 2}, {80, 8}, {160, 2}}) {
    if (options.corpora_alone) break;
    Row row(*backend, fmt::format("{:.0f} px, noise {:.0f}", side, noise));
    for (int i = 0; i < options.frames; ++i) {
      const sim::Scene scene = sim::close_up_scene(paper_camera(), {side, noise}, i);
      row.add(scene.camera, sim::Renderer(scene.camera, 4).render(scene).view(), sim::truth(scene));
    }
    row.print();
  }
  for (const std::string& name : options.corpora) {
    Row row(*backend, name);
    std::unique_ptr<sim::Renderer> renderer;
    for (int i = 0; i < options.frames; ++i) {
      sim::Scene scene = sim::corpus_scene(name, i, 640, 480);
      if (options.straight_tones) {
        scene.sensor.gamma = 1;
        scene.sensor.white_level = std::min(scene.sensor.white_level, 160.0);
        scene.lighting.glares.clear();
      }
      if (!renderer) renderer = std::make_unique<sim::Renderer>(scene.camera, options.fineness);
      row.add(scene.camera, renderer->render(scene).view(), sim::truth(scene));
    }
    row.print();
  }
  return 0;
}

}  // namespace
}  // namespace berth::bench

int main(int argc, char** argv) { return berth::bench::run_main("consistency", berth::bench::run, argc, argv); }
