// How often the wrong one of a plane's two poses is taken while a marker that nearly faces the camera comes nearer:
// frame by frame, and with the filter over time. Corners are simulated, by the covariance that they come with.
#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "berth/pose_filter.hpp"
#include "run_main.hpp"
#include "support/docking_approach.hpp"
#include "support/noisy_corners.hpp"
#include "target/marker_pose.hpp"
#include "target/motion.hpp"
#include "target/side_covariance.hpp"
#include "target/symmetric.hpp"

namespace berth::bench {
namespace {

constexpr std::int64_t kFrame_ns = 1'000'000'000 / 70;
constexpr int kBorder = 8;
constexpr double kBlur_px = 0.75;

struct Case {
  std::string name;
  double size_m;
  /// Of every coordinate by itself; or, `edges`, the mean distance of a side's stations from their line, of which
  /// the corners' covariance is made as a detector does (docs/corners.md).
  double deviation_px;
  bool edges;
};

const std::vector<Case> kCases = {
    {"100 mm, 0.02 px", 0.1, 0.02, false},
    {"100 mm, 0.05 px", 0.1, 0.05, false},
    {"100 mm, 0.08 px", 0.1, 0.08, false},
    {"100 mm, 0.15 px", 0.1, 0.15, false},
    {"50 mm, 0.02 px", 0.05, 0.02, false},
    {"50 mm, 0.15 px", 0.05, 0.15, false},
    {"100 mm, edges, stations 0.03 px", 0.1, 0.03, true},
    {"100 mm, edges, stations 0.12 px", 0.1, 0.12, true},
    {"50 mm, edges, stations 0.03 px", 0.05, 0.03, true},
};

CornerCovariance covariance_of(const Case& one, const Corners4& corners) {
  if (!one.edges) return independent_corners(one.deviation_px);
  std::array<SideFit, 4> fits;
  for (std::size_t k = 0; k < 4; ++k) {
    const auto &a = corners[k], &b = corners[(k + 1) % 4];
    const double length = std::hypot(b[0] - a[0], b[1] - a[1]);
    fits[k] = {std::min(32, std::max(3, static_cast<int>(0.75 * length) - 2)), one.deviation_px};
  }
  return side_covariance(corners, kBorder, fits, {kBlur_px, kBlur_px, kBlur_px, kBlur_px});
}

Detection seen(const Case& one, const Pose& truth, sim::Random& random) {
  const CameraModel camera = paper_camera();
  Detection marker;
  marker.corners = seen_corners(camera, truth, one.size_m);
  marker.corner_covariance_px2 = covariance_of(one, marker.corners);
  CornerCovariance factor = *marker.corner_covariance_px2;
  if (!factorise<8>(factor)) return marker;
  std::array<double, 8> unit;
  for (double& value : unit) value = normal(random);
  for (std::size_t i = 0; i < 8; ++i) {
    for (std::size_t k = 0; k <= i; ++k) marker.corners[i / 2][i % 2] += factor[8 * i + k] * unit[k];
  }
  marker.has_pose = marker_pose(camera, one.size_m, marker.corners, *marker.corner_covariance_px2, marker.pose,
                                marker.pose_uncertainty.emplace());
  return marker;
}

double turned(const Pose& a, const Pose& b) {
  const auto step = step_between(a, b);
  return length({step[3], step[4], step[5]});
}

double deviation(const std::array<double, 36>& covariance) {
  return std::sqrt(covariance[21] + covariance[28] + covariance[35]);
}

struct Counts {
  int frames = 0, alone = 0, filtered = 0, sure = 0, sure_wrong = 0;
  double alone_squares = 0, squares = 0;
};

// Wrong: nearer to the other pose of the plane than to the truth, and off by more than four deviations.
void fly(const Case& one, u64 seed, int frames, Counts& counts) {
  const test::Approach approach(seed);
  sim::Random random(seed + 1000);
  PoseFilterConfig config;
  config.camera = paper_camera();
  config.marker_size_m = one.size_m;
  PoseFilter filter(config);
  for (int i = 0; i < frames; ++i) {
    const Pose truth = approach.pose(i);
    const Detection marker = seen(one, truth, random);
    if (!marker.has_pose) continue;
    const FilteredPose& pose = filter.update(i * kFrame_ns, &marker);
    ++counts.frames;
    const double alone = turned(marker.pose, truth), filtered = turned(pose.pose, truth);
    counts.alone_squares += alone * alone;
    counts.squares += filtered * filtered;
    counts.sure += pose.sure ? 1 : 0;
    const PoseUncertainty& known = *marker.pose_uncertainty;
    if (!known.has_other) continue;
    const double other = turned(known.other, truth);
    counts.alone += other < alone && alone > 4 * deviation(known.covariance) ? 1 : 0;
    const Pose& bad = other > alone ? known.other : marker.pose;
    const bool wrong = turned(bad, pose.pose) < filtered && filtered > 4 * deviation(pose.covariance);
    counts.filtered += wrong ? 1 : 0;
    counts.sure_wrong += wrong && pose.sure ? 1 : 0;
  }
}

int run(int argc, char** argv) {
  int frames = 100000;
  std::string only;
  CLI::App app(
      "Wrong choices between a plane's two poses, marker within 10 degrees of facing the camera, 1.5 to 0.3 m in "
      "flights "
      "of 1,000 frames: frame by frame, by the filter, and of those where it says that it is sure.");
  app.add_option("--frames", frames, "frames a row")->check(CLI::Range(1000, 10000000));
  app.add_option("--only", only, "rows whose name begins so");
  CLI11_PARSE(app, argc, argv);
  fmt::print(
      "| marker, noise | frames | wrong, frame by frame | wrong, filtered | of these sure | frames sure, % | rotation "
      "RMS, "
      "frame by frame ° | filtered ° |\n|---|---|---|---|---|---|---|---|\n");
  for (const Case& one : kCases) {
    if (one.name.rfind(only, 0) != 0) continue;
    Counts counts;
    for (int flight = 0; flight < frames / test::Approach::kFrames; ++flight) {
      fly(one, static_cast<u64>(flight), test::Approach::kFrames, counts);
    }
    const auto degrees = [&](double squares) { return kDegrees * std::sqrt(squares / counts.frames); };
    fmt::print("| {} | {} | {} | {} | {} | {:.1f} | {:.2f} | {:.2f} |\n", one.name, counts.frames, counts.alone,
               counts.filtered, counts.sure_wrong, 100.0 * counts.sure / counts.frames, degrees(counts.alone_squares),
               degrees(counts.squares));
    std::fflush(stdout);
  }
  return 0;
}

}  // namespace
}  // namespace berth::bench

int main(int argc, char** argv) { return berth::bench::run_main("flips", berth::bench::run, argc, argv); }
