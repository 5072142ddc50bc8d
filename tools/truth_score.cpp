#include "truth_score.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>

#include "exact_math.hpp"

namespace berth::cli {
namespace {

double median(std::vector<double> values) {
  if (values.empty()) return 0;
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

double largest(const std::vector<double>& values) {
  return values.empty() ? 0 : *std::max_element(values.begin(), values.end());
}

}  // namespace

const TruthMarker* truth_of(const Detection& detection, const std::vector<TruthMarker>& truth) {
  for (const TruthMarker& marker : truth) {
    if (marker.id == detection.id && marker.family == detection.family->name) return &marker;
  }
  return nullptr;
}

double distance_m(const Pose& a, const Pose& b) {
  double sum = 0;
  for (int i = 0; i < 3; ++i) sum += (a.t[i] - b.t[i]) * (a.t[i] - b.t[i]);
  return std::sqrt(sum);
}

double angle_deg(const Pose& a, const Pose& b) {
  // |A − B|_F = 2 √2 sin(angle / 2): unlike acos of the trace, exact for small angles too.
  double sum = 0;
  for (int i = 0; i < 9; ++i) sum += (a.R[i] - b.R[i]) * (a.R[i] - b.R[i]);
  return 2 * std::asin(std::min(1.0, std::sqrt(sum / 8))) * kDegrees;
}

double corner_rmse_px(const std::array<std::array<double, 2>, 4>& a, const std::array<std::array<double, 2>, 4>& b) {
  double sum = 0;
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < 2; ++k) sum += (a[i][k] - b[i][k]) * (a[i][k] - b[i][k]);
  }
  return std::sqrt(sum / 4);
}

void TruthScore::add(const std::vector<TruthMarker>& truth, const std::vector<Detection>& detections) {
  for (const TruthMarker& marker : truth) {
    MarkerScore& score = markers_[{marker.family, marker.id}];
    score.size_m = marker.size_m;
    if (marker.visible < 0.999) continue;
    ++score.shown;
    for (const Detection& detection : detections) {
      if (truth_of(detection, truth) == &marker) {
        ++score.found;
        break;
      }
    }
  }
  for (const Detection& detection : detections) {
    const TruthMarker* marker = truth_of(detection, truth);
    if (marker == nullptr) {
      ++false_positives_;
      continue;
    }
    MarkerScore& score = markers_[{marker->family, marker->id}];
    score.corner_px.push_back(corner_rmse_px(detection.corners, marker->corners));
    if (!detection.has_pose) continue;
    const double off_m = distance_m(detection.pose, marker->pose);
    score.position_mm.push_back(off_m * 1000);
    score.position_percent.push_back(off_m / distance_m(Pose(), marker->pose) * 100);
    score.rotation_deg.push_back(angle_deg(detection.pose, marker->pose));
  }
}

void TruthScore::add_body(const std::string& label, const Pose* pose, const Pose& truth) {
  BodyScore& score = bodies_[label];
  ++score.frames;
  if (pose == nullptr) return;
  const double off_m = distance_m(*pose, truth);
  score.position_mm.push_back(off_m * 1000);
  score.position_percent.push_back(off_m / distance_m(Pose(), truth) * 100);
  score.rotation_deg.push_back(angle_deg(*pose, truth));
}

void TruthScore::print(std::ostream& out) const {
  out << "errors against the simulator's truth (median / largest)\n"
      << fmt::format("  {:<22} {:>5} {:>13} {:>15} {:>17} {:>15} {:>17}\n", "marker", "mm", "found", "corners px",
                     "position mm", "% of range", "rotation deg");
  const auto pair = [](const std::vector<double>& values, int digits) {
    if (values.empty()) return std::string("-");
    return fmt::format("{:.{}f} / {:.{}f}", median(values), digits, largest(values), digits);
  };
  for (const auto& [key, score] : markers_) {
    const double rate = score.shown == 0 ? 0 : 100.0 * score.found / score.shown;
    out << fmt::format(
        "  {:<22} {:>5.0f} {:>13} {:>15} {:>17} {:>15} {:>17}\n", fmt::format("{} {}", key.first, key.second),
        score.size_m * 1000,
        score.shown == 0 ? std::string("never whole") : fmt::format("{}/{} {:.0f}%", score.found, score.shown, rate),
        pair(score.corner_px, 3), pair(score.position_mm, 2), pair(score.position_percent, 3),
        pair(score.rotation_deg, 3));
  }
  for (const auto& [label, score] : bodies_) {
    out << fmt::format("  {:<22} {:>5} {:>13} {:>15} {:>17} {:>15} {:>17}\n", label, "",
                       fmt::format("{}/{}", score.position_mm.size(), score.frames), "", pair(score.position_mm, 2),
                       pair(score.position_percent, 3), pair(score.rotation_deg, 3));
  }
  out << "  false positives: " << false_positives_ << '\n';
}

}  // namespace berth::cli
