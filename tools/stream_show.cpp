#include "stream_show.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <string>

#include "bundle_show.hpp"
#include "target_show.hpp"
#include "truth_score.hpp"

namespace berth::cli {
namespace {

double area_of(const Detection& d) {
  double twice = 0;
  for (int i = 0; i < 4; ++i) {
    const std::array<double, 2>&a = d.corners[i], &b = d.corners[(i + 1) % 4];
    twice += a[0] * b[1] - b[0] * a[1];
  }
  return std::abs(twice) / 2;
}

/// Where it is, as a row has room for it: without deviations, and where there is a pose the place in the image gives
/// way to it, it fits 80 columns.
std::string place_of(const Detection& d, const std::vector<TruthMarker>& truth) {
  if (!d.has_pose) return fmt::format("({:7.2f}, {:7.2f}) px", d.center[0], d.center[1]);
  const std::array<double, 3>& t = d.pose.t;
  std::string text = fmt::format("xyz {:+.4f} {:+.4f} {:.4f} m", t[0], t[1], t[2]);
  if (const TruthMarker* marker = truth_of(d, truth)) {
    text += fmt::format(", off {:.2f} mm {:.2f} deg", distance_m(d.pose, marker->pose) * 1000,
                        angle_deg(d.pose, marker->pose));
  }
  return text;
}

}  // namespace

void StreamShow::show(std::size_t done, double rate, const FrameResult& result, const std::vector<TruthMarker>& truth,
                      const SystematicCovariances& systematic, const DetectorConfig& config) {
  const std::size_t n = result.detections.size();
  std::string line = fmt::format("{:4.0f} fps  {} marker{}", rate, n, n == 1 ? " " : "s");
  if (result.status == FrameStatus::overflow) line += ", overflow";
  std::vector<std::string> table;
  const Detection* largest = nullptr;
  std::string brief;
  for (std::size_t i = 0; i < n; ++i) {
    const Detection& d = result.detections[i];
    std::string place = place_of(d, truth);
    if (systematic[i]) place += range_deviations(d, *systematic[i]);
    table.push_back(fmt::format("  {:<14} {:>4}  {}", d.family->name, d.id, place));
    if (largest == nullptr || area_of(d) > area_of(*largest)) {
      largest = &d;
      brief = fmt::format("id {} {}", d.id, place);
    }
  }
  for (std::size_t i = 0; i < result.bundles.size(); ++i) {
    table.push_back("  " + describe(config.bundles[i].name, result.bundles[i]));
  }
  for (std::size_t i = 0; i < result.disc_targets.size(); ++i) {
    table.push_back("  " + describe(config.disc_targets[i], result.disc_targets[i]));
  }
  view_.show(done, line, table, brief);
}

}  // namespace berth::cli
