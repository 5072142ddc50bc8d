#include "survey/survey.hpp"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <limits>

#include "exact_math.hpp"
#include "survey/deviations.hpp"
#include "survey/net.hpp"
#include "survey/settle.hpp"
#include "survey/start.hpp"

namespace berth {
namespace {

// Fewer leave nothing to tell a wrong reading by.
constexpr int kLeastFrames = 5, kLeastSights = 3;
// A plane seen from one side only may lean either way (docs/pose.md).
constexpr double kLeastViewRange_deg = 10;
// What is wrong in so many places is not an outlier.
constexpr double kLeastKept = 2.0 / 3, kMostRejected = 0.25, kMostRms_px = 1;
// A place that is known no better is of no use.
constexpr double kMostTurn_deg = 3, kMostOfSize = 0.1;

std::string number(double value, int digits) {
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

bool before(const BundleMarker& a, const BundleMarker& b) {
  return a.family->name != b.family->name ? a.family->name < b.family->name : a.id < b.id;
}
bool is_of(const BundleMarker& marker, const Detection& seen) {
  return marker.family == seen.family && marker.id == seen.id;
}

// Markers in so many frames or more, in order.
std::vector<BundleMarker> often_seen(const SurveyFrames& frames, const SurveyOptions& options, Survey& result) {
  std::vector<BundleMarker> markers;
  std::vector<int> counts;
  for (const SurveyFrame& frame : frames.frames()) {
    for (const Detection& seen : frame.markers) {
      const auto known = std::find_if(markers.begin(), markers.end(), [&](const auto& m) { return is_of(m, seen); });
      if (known != markers.end()) {
        ++counts[static_cast<std::size_t>(known - markers.begin())];
        continue;
      }
      const auto size = options.sizes_m.find(seen.id);
      markers.push_back({seen.family, seen.id, size == options.sizes_m.end() ? options.size_m : size->second, {}});
      counts.push_back(1);
    }
  }
  std::vector<BundleMarker> often;
  for (std::size_t m = 0; m < markers.size(); ++m) {
    if (counts[m] >= kLeastSights) {
      often.push_back(markers[m]);
      continue;
    }
    result.notes.push_back(name_of(markers[m]) + " is left out: it was seen with others in " +
                           std::to_string(counts[m]) + " of the " + std::to_string(kLeastSights) + " frames it takes");
  }
  std::sort(often.begin(), often.end(), before);
  return often;
}

SurveyNet net_of(const SurveyFrames& frames, const CameraModel& camera, std::vector<BundleMarker> markers,
                 double deviation_px) {
  SurveyNet net;
  net.camera = camera;
  net.markers = std::move(markers);
  for (const SurveyFrame& frame : frames.frames()) {
    SurveyStation station;
    for (const Detection& seen : frame.markers) {
      for (std::size_t m = 0; m < net.markers.size(); ++m) {
        if (!is_of(net.markers[m], seen)) continue;
        Sight sight;
        sight.marker = m;
        sight.seen_px = seen.corners;
        const CornerCovariance covariance = corner_covariance(seen, deviation_px);
        for (std::size_t k = 0; k < 4; ++k) sight.covariances_px2[k] = block_of(covariance, k);
        sight.by_lines = !seen.corner_fit;
        station.sights.push_back(sight);
      }
    }
    if (station.is_used()) net.stations.push_back(std::move(station));
  }
  return net;
}

// The marker asked for, or the one in most frames; of equals the largest, whose pose is known best.
bool choose_origin(const SurveyOptions& options, SurveyNet& net, std::vector<std::string>& objections) {
  std::vector<int> counts(net.markers.size());
  for (const SurveyStation& station : net.stations) {
    for (const Sight& sight : station.sights) ++counts[sight.marker];
  }
  bool found = false;
  for (std::size_t m = 0; m < net.markers.size(); ++m) {
    if (options.origin && net.markers[m].id != *options.origin) continue;
    const bool more = counts[m] > counts[net.origin];
    const bool larger = counts[m] == counts[net.origin] && net.markers[m].size_m > net.markers[net.origin].size_m;
    if (!found || more || larger) net.origin = m;
    found = true;
  }
  if (!found) {
    objections.push_back("the origin, marker " + std::to_string(options.origin.value_or(0)) +
                         ", was seen with others in fewer than " + std::to_string(kLeastSights) +
                         " frames; choose another of " + names_of(net, std::vector<bool>(net.markers.size(), true)));
  }
  return found;
}

bool is_connected(const SurveyNet& net, std::vector<std::string>& objections) {
  std::vector<bool> apart = unconnected(net);
  if (std::find(apart.begin(), apart.end(), true) == apart.end()) return true;
  const std::string away = names_of(net, apart);
  apart.flip();
  objections.push_back("unconnected: " + away + " and " + names_of(net, apart) + " share fewer than " +
                       std::to_string(kLeastTogether) +
                       " frames, also by way of others; take frames that show one of each");
  return false;
}

double view_range_deg(const SurveyNet& net) {
  Vec3 middle{};
  for (const BundleMarker& marker : net.markers) {
    middle = add(middle, scaled(marker.pose.t, 1 / static_cast<double>(net.markers.size())));
  }
  std::vector<Vec3> directions;
  for (const SurveyStation& station : net.stations) {
    if (station.is_used()) directions.push_back(normalized(add(inverse(station.camera).t, scaled(middle, -1))));
  }
  double least = 1;
  for (const Vec3& a : directions) {
    for (const Vec3& b : directions) least = std::min(least, dot(a, b));
  }
  return std::acos(std::max(-1.0, least)) * kDegrees;
}

// Frames, corners, residuals. Returns the sum of squares of the kept corners, in standard deviations.
double count(const SurveyNet& net, Survey& result) {
  result.markers.assign(net.markers.size(), {});
  for (const SurveyStation& station : net.stations) {
    if (!station.is_used()) continue;
    ++result.frames;
    for (const Sight& sight : station.sights) result.markers[sight.marker].frames += sight.is_kept() ? 1 : 0;
  }
  double whitened = 0;
  std::vector<double> squares(net.markers.size());
  std::vector<int> kept(net.markers.size());
  each_corner(net,
              [&](const SurveyStation& station, const Sight& sight, std::size_t k, const Vec2& off, double square) {
                SurveyedMarker& marker = result.markers[sight.marker];
                ++marker.corners;
                const bool fits = sight.is_kept() && sight.kept[k];
                marker.rejected += fits ? 0 : 1;
                if (!fits || !station.is_used()) return;
                whitened += square;
                squares[sight.marker] += off[0] * off[0] + off[1] * off[1];
                ++kept[sight.marker];
              });
  double all = 0;
  int all_kept = 0;
  for (std::size_t m = 0; m < net.markers.size(); ++m) {
    result.corners += result.markers[m].corners;
    result.rejected += result.markers[m].rejected;
    result.markers[m].rms_px = kept[m] > 0 ? std::sqrt(squares[m] / kept[m]) : 0;
    all += squares[m];
    all_kept += kept[m];
  }
  result.rms_px = all_kept > 0 ? std::sqrt(all / all_kept) : 0;
  return whitened;
}

// Of a coordinate of a corner, m: a turn by w moves corners, half a diagonal away, by w size / sqrt(3) on average.
double corner_deviation_m(const BundleMarker& marker, const SurveyedMarker& known) {
  const double turned = known.turn_deviation_deg() / kDegrees * marker.size_m / std::sqrt(3.0);
  return std::sqrt((known.position_deviation_m() * known.position_deviation_m() + turned * turned) / 3);
}

// What is wrong with a result that there is.
void judge(const SurveyNet& net, Survey& result) {
  std::vector<std::string>& all = result.objections;
  if (result.view_range_deg < kLeastViewRange_deg) {
    all.push_back("one view direction: the frames look from within " + number(result.view_range_deg, 1) +
                  " degrees, where a plane may lean either way; take frames from 20 to 60 degrees apart");
  }
  const double rejected = static_cast<double>(result.rejected) / result.corners;
  if (!(rejected < kMostRejected)) {
    all.push_back(number(100 * rejected, 0) +
                  " % of the corners do not fit; check the sizes and the camera, and that no "
                  "marker moves or is there twice");
  }
  if (!(result.rms_px < kMostRms_px)) {
    all.push_back("the corners are " + number(result.rms_px, 2) +
                  " px from where they should be; check the sizes and the camera, and that no marker moves or bends");
  }
  for (std::size_t m = 0; m < net.markers.size(); ++m) {
    const SurveyedMarker& marker = result.markers[m];
    if (!(marker.turn_deviation_deg() < kMostTurn_deg) ||
        !(marker.position_deviation_m() < kMostOfSize * net.markers[m].size_m)) {
      all.push_back(name_of(net.markers[m]) + " is known to " + number(1000 * marker.position_deviation_m(), 1) +
                    " mm and " + number(marker.turn_deviation_deg(), 1) +
                    " degrees only; take more frames of it, nearer and from other sides");
    }
  }
}

double root_of_squares(double a, double b, double c) { return std::sqrt(a * a + b * b + c * c); }

}  // namespace

double SurveyedMarker::position_deviation_m() const {
  return root_of_squares(deviations[0], deviations[1], deviations[2]);
}
double SurveyedMarker::turn_deviation_deg() const {
  return root_of_squares(deviations[3], deviations[4], deviations[5]);
}

Survey survey(const SurveyFrames& frames, const CameraModel& camera, const SurveyOptions& options) {
  Survey result;
  SurveyNet net = net_of(frames, camera, often_seen(frames, options, result), options.corner_deviation_px);
  if (net.stations.size() < static_cast<std::size_t>(kLeastFrames)) {
    result.objections.push_back("too few frames: " + std::to_string(net.stations.size()) + " of the " +
                                std::to_string(kLeastFrames) +
                                " it takes show two markers or more, each from another place");
    return result;
  }
  if (!choose_origin(options, net, result.objections) || !is_connected(net, result.objections)) return result;
  start_net(net, options.free_sizes);
  if (!settle(net, options.free_sizes)) {
    result.objections.push_back("no solution: the frames do not agree about where the markers are; check the sizes");
    return result;
  }
  const double squares = count(net, result);
  result.origin = net.origin;
  result.bundle.markers = net.markers;
  result.view_range_deg = view_range_deg(net);
  for (std::size_t m = 0; m < net.markers.size(); ++m) {
    const SurveyedMarker& marker = result.markers[m];
    const int seen = marker.corners / 4;
    if (marker.frames >= kLeastSights && marker.frames > kLeastKept * seen) continue;
    result.objections.push_back(name_of(net.markers[m]) + " does not keep its place: it fits in " +
                                std::to_string(marker.frames) + " of " + std::to_string(seen) +
                                " frames; check its size, and that it is there once and does not move");
  }
  if (result.frames < kLeastFrames)
    result.objections.push_back("the frames do not agree about where the markers are; check the sizes and the camera");
  if (!result.objections.empty() || !is_connected(net, result.objections)) return result;
  if (!set_deviations(net, options.free_sizes, squares, result)) {
    result.objections.push_back("the frames leave a marker's place open; take more, from other sides and nearer");
  }
  for (std::size_t m = 0; m < net.markers.size(); ++m) {
    result.bundle.deviation_m =
        std::max(result.bundle.deviation_m, corner_deviation_m(net.markers[m], result.markers[m]));
  }
  if (result.objections.empty()) judge(net, result);
  return result;
}

}  // namespace berth
