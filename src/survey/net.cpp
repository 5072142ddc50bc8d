#include "survey/net.hpp"

#include <algorithm>

namespace berth {

bool SurveyStation::is_used() const {
  return std::count_if(sights.begin(), sights.end(), [](const Sight& sight) { return sight.is_kept(); }) >= 2;
}

std::string names_of(const SurveyNet& net, const std::vector<bool>& chosen) {
  std::string names;
  for (std::size_t m = 0; m < net.markers.size(); ++m) {
    if (chosen[m]) names += (names.empty() ? "" : ", ") + name_of(net.markers[m]);
  }
  return names;
}

bool residual(const SurveyNet& net, const SurveyStation& station, const Sight& sight, std::size_t corner,
              Vec2& off_px) {
  const BundleMarker& marker = net.markers[sight.marker];
  const Vec3 at = transform(station.camera, transform(marker.pose, corner_places(marker.size_m)[corner]));
  if (!(at[2] > 0)) return false;
  const Vec2 image = image_of(net.camera, at), seen = sight.seen_px[corner];
  off_px = {seen[0] - image[0], seen[1] - image[1]};
  return finite(off_px[0]) && finite(off_px[1]);
}

int unknowns_of(const SurveyNet& net, bool free_sizes) {
  const auto used = std::count_if(net.stations.begin(), net.stations.end(), [](const auto& s) { return s.is_used(); });
  return 6 * static_cast<int>(used) + (free_sizes ? 7 : 6) * (static_cast<int>(net.markers.size()) - 1);
}

std::vector<int> sighted_together(const SurveyNet& net) {
  const std::size_t count = net.markers.size();
  std::vector<int> together(count * count);
  for (const SurveyStation& station : net.stations) {
    for (const Sight& a : station.sights) {
      for (const Sight& b : station.sights) {
        if (a.marker != b.marker && a.is_kept() && b.is_kept()) ++together[a.marker * count + b.marker];
      }
    }
  }
  return together;
}

std::vector<bool> unconnected(const SurveyNet& net) {
  const std::size_t count = net.markers.size();
  const std::vector<int> together = sighted_together(net);
  std::vector<bool> open(count, true);
  std::vector<std::size_t> reached = {net.origin};
  open[net.origin] = false;
  for (std::size_t k = 0; k < reached.size(); ++k) {
    for (std::size_t m = 0; m < count; ++m) {
      if (!open[m] || together[reached[k] * count + m] < kLeastTogether) continue;
      open[m] = false;
      reached.push_back(m);
    }
  }
  return open;
}

}  // namespace berth
