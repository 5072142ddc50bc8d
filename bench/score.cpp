#include "score.hpp"

#include <algorithm>
#include <cmath>

namespace berth::bench {
namespace {

/// Share of a marker that must be visible for it to count as required.
constexpr double kFullyVisible = 0.999;

double distance(const std::array<double, 2>& a, const std::array<double, 2>& b) {
  return std::hypot(a[0] - b[0], a[1] - b[1]);
}

bool covers(const TruthMarker& marker, const Found& found) {
  if (marker.family != "tag36h11" || marker.id != found.id) return false;
  for (std::size_t k = 0; k < 4; ++k) {
    const double side = distance(marker.corners[k], marker.corners[(k + 1) % 4]);
    if (distance(marker.corners[k], found.corners[k]) > std::max(2.0, side / 4)) return false;
  }
  return true;
}

}  // namespace

double Score::corner_rms_px() const { return corners == 0 ? 0 : std::sqrt(square_error / corners); }

void Score::add(const std::vector<TruthMarker>& truth, const std::vector<Found>& found) {
  std::vector<bool> used(found.size(), false);
  for (const TruthMarker& marker : truth) {
    const bool counts = marker.visible >= kFullyVisible && marker.family == "tag36h11";
    if (counts) ++required;
    for (std::size_t i = 0; i < found.size(); ++i) {
      if (used[i] || !covers(marker, found[i])) continue;
      used[i] = true;
      if (!counts) {
        ++extra;
        break;
      }
      ++recalled;
      for (std::size_t k = 0; k < 4; ++k) {
        const double error = distance(marker.corners[k], found[i].corners[k]);
        square_error += error * error;
        ++corners;
      }
      break;
    }
  }
  false_positives += static_cast<int>(std::count(used.begin(), used.end(), false));
}

}  // namespace berth::bench
