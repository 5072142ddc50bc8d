#include "score_curve.hpp"

#include <algorithm>

namespace berth::cli {
namespace {

/// Scores end at 1.
constexpr int kAboveAll = 32769;

}  // namespace

std::vector<CurvePoint> score_curve(std::vector<Scored> images) {
  std::sort(images.begin(), images.end(), [](const Scored& a, const Scored& b) { return a.score_q15 > b.score_q15; });
  CurvePoint point{kAboveAll, {}};
  for (const Scored& image : images) point.decisions.count(image.present, false);
  std::vector<CurvePoint> curve = {point};
  for (const Scored& image : images) {
    if (image.score_q15 != point.threshold_q15) curve.push_back(point);
    point.threshold_q15 = image.score_q15;
    Decisions& d = point.decisions;
    (image.present ? d.right_found : d.false_found)++;
    (image.present ? d.missed : d.right_absent)--;
    curve.back() = point;
  }
  return curve;
}

std::optional<double> roc_area(const std::vector<CurvePoint>& curve) {
  const Decisions& all = curve.front().decisions;
  if (all.present() == 0 || all.absent() == 0) return std::nullopt;
  long long twice = 0;
  for (std::size_t i = 1; i < curve.size(); ++i) {
    const Decisions& from = curve[i - 1].decisions;
    const Decisions& to = curve[i].decisions;
    twice += static_cast<long long>(to.false_found - from.false_found) * (to.right_found + from.right_found);
  }
  return static_cast<double>(twice) / (2.0 * all.present() * all.absent());
}

std::optional<double> average_precision(const std::vector<CurvePoint>& curve) {
  if (curve.front().decisions.present() == 0) return std::nullopt;
  double area = 0;
  for (std::size_t i = 1; i < curve.size(); ++i) {
    const Decisions& from = curve[i - 1].decisions;
    const Decisions& to = curve[i].decisions;
    area += (to.right_found - from.right_found) * to.precision() / to.present();
  }
  return area;
}

}  // namespace berth::cli
