#include "survey/deviations.hpp"

#include <algorithm>
#include <cmath>

#include "exact_math.hpp"
#include "survey/adjust.hpp"

namespace berth {
namespace {

constexpr std::size_t kGroups = 10;
constexpr double kLeastGroups = 5, kByChance = 1.3;

// By how much the deviations are larger than they would be if every residual were by chance and on its own: frames in a
// row share their errors, and so do a marker's corners. From how far the markers move when a run of frames is left out
// (the jackknife, by groups), all coordinates together. 1 where it might be by chance, or too few groups can be spared.
double correlation_factor(const SurveyNet& net, bool free_sizes, const Survey& result) {
  std::vector<std::vector<std::array<double, 6>>> moves;  // of each group, of each marker
  const std::size_t parts = std::min(kGroups, net.stations.size());
  for (std::size_t g = 0; g < parts; ++g) {
    SurveyNet part = net;
    const auto at = [&](std::size_t k) {
      return part.stations.begin() + static_cast<std::ptrdiff_t>(k * net.stations.size() / parts);
    };
    part.stations.erase(at(g), at(g + 1));
    const std::vector<bool> apart = unconnected(part);
    if (std::find(apart.begin(), apart.end(), true) != apart.end() || !adjust(part, free_sizes, 0)) continue;
    moves.emplace_back();
    for (std::size_t m = 0; m < net.markers.size(); ++m) {
      moves.back().push_back(step_between(net.markers[m].pose, part.markers[m].pose));
    }
  }
  const auto groups = static_cast<double>(moves.size());
  if (groups < kLeastGroups) return 1;
  double sum = 0;
  for (std::size_t m = 0; m < net.markers.size(); ++m) {
    if (m == net.origin) continue;
    for (std::size_t i = 0; i < 6; ++i) {
      double mean = 0, squares = 0;
      for (const auto& group : moves) mean += group[m][i] / groups;
      for (const auto& group : moves) squares += (group[m][i] - mean) * (group[m][i] - mean);
      const double expected = result.markers[m].deviations[i] / (i < 3 ? 1 : kDegrees);
      sum += (groups - 1) / groups * squares / (expected * expected);
    }
  }
  const double factor = std::sqrt(sum / (6 * (static_cast<double>(net.markers.size()) - 1)));
  return factor > kByChance ? factor : 1;
}

}  // namespace

bool set_deviations(const SurveyNet& net, bool free_sizes, double squares, Survey& result) {
  NetCovariance covariance;
  int kept = 0;
  for (const SurveyStation& station : net.stations) {
    for (const Sight& sight : station.sights) {
      if (!station.is_used() || !sight.is_kept()) continue;
      kept += static_cast<int>(std::count(sight.kept.begin(), sight.kept.end(), true));
    }
  }
  const double freedom = 2.0 * kept - unknowns_of(net, free_sizes);
  if (!(freedom > 0) || !net_covariance(net, free_sizes, covariance)) return false;
  const double scale = std::sqrt(squares / freedom);
  for (std::size_t m = 0; m < net.markers.size(); ++m) {
    SurveyedMarker& marker = result.markers[m];
    for (std::size_t i = 0; i < 6; ++i) {
      marker.deviations[i] = scale * std::sqrt(covariance.markers[m][7 * i]) * (i < 3 ? 1 : kDegrees);
    }
    marker.size_deviation_m = scale * std::sqrt(covariance.sizes_m2[m]);
  }
  result.correlation = correlation_factor(net, free_sizes, result);
  for (SurveyedMarker& marker : result.markers) {
    for (double& deviation : marker.deviations) deviation *= result.correlation;
    marker.size_deviation_m *= result.correlation;
  }
  return true;
}

}  // namespace berth
