#include "flight_run.hpp"

#include <algorithm>
#include <cmath>

#include "pose_algebra.hpp"
#include "quantile.hpp"

namespace berth::cli {

FlightPoint flight_point(int index, const navset::FlightFrame& truth, const PilotFrame& found) {
  FlightPoint point;
  point.frame = index;
  point.mode = found.mode;
  point.change = found.change;
  point.true_range_m = sim::length(truth.target.t);
  point.has_position = found.has_position;
  point.sighted = found.looked_for_target && found.sighting->status == FrameStatus::ok;
  if (!found.has_position) return point;
  point.from_marker = found.from_marker;
  point.range_m = sim::length(found.position_m);
  if (!found.from_marker) point.range_deviation_m = found.sighting->range_deviation_m;
  const auto at = image_of(navset::Flight::camera(), found.position_m);
  const double dx = at[0] - truth.x;
  const double dy = at[1] - truth.y;
  point.off = std::sqrt(dx * dx + dy * dy) / truth.d_px;
  return point;
}

int FlightLog::first(Mode mode) const {
  const auto found =
      std::find_if(points.begin(), points.end(), [mode](const FlightPoint& p) { return p.mode == mode; });
  return found == points.end() ? -1 : found->frame;
}

int FlightLog::longest_gap() const {
  int longest = 0;
  int gap = 0;
  bool begun = false;
  for (const FlightPoint& point : points) {
    begun = begun || point.has_position;
    gap = begun && !point.has_position ? gap + 1 : 0;
    longest = std::max(longest, gap);
  }
  return longest;
}

int FlightLog::wrong() const {
  return static_cast<int>(
      std::count_if(points.begin(), points.end(), [](const FlightPoint& point) { return point.wrong(); }));
}

int FlightLog::sightings() const {
  return static_cast<int>(
      std::count_if(points.begin(), points.end(), [](const FlightPoint& point) { return point.sighted; }));
}

PilotConfig flight_pilot(const std::string& network) {
  PilotConfig config;
  config.detector.camera = navset::Flight::camera();
  config.detector.marker_size_m = navset::kDockMarkerSide_m;
  config.navigator.network = network;
  config.navigator.target_diameter_m = navset::kTargetDiameter_m;
  config.marker = navset::kDockMarker;
  // The marker's place in the target's frame, turned round: the two frames are parallel.
  for (std::size_t i = 0; i < 3; ++i) config.target_in_marker_m[i] = -navset::dock_marker_pose().t[i];
  return config;
}

FlightLog fly(const navset::Flight& flight, u64 seed, Pilot& pilot, const FlightWatcher& seen) {
  FlightLog log{seed, flight.title(), {}};
  for (int i = 0; i < flight.frames(); ++i) {
    const navset::FlightFrame frame = flight.frame(i);
    FrameStamp stamp;
    stamp.sequence = static_cast<u64>(i);
    const PilotFrame& found = pilot.look(frame.image.view(), stamp);
    log.points.push_back(flight_point(i, frame, found));
    if (seen) seen(log.points.back(), frame, found);
  }
  return log;
}

Json to_json(const FlightLog& log) {
  Json line;
  line["seed"] = log.seed;
  line["title"] = log.title;
  line["frames"] = log.points.size();
  line["docked"] = log.docked();
  line["navigation_from"] = log.first(Mode::navigation);
  line["docking_from"] = log.first(Mode::docking);
  line["longest_gap"] = log.longest_gap();
  line["wrong"] = log.wrong();
  line["sightings"] = log.sightings();
  line["changes"] = Json::array();
  for (const FlightPoint& point : log.points) {
    if (point.change.empty()) continue;
    line["changes"].push_back({{"frame", point.frame},
                               {"to", name_of(point.mode)},
                               {"range_m", std::round(point.true_range_m * 1000) / 1000},
                               {"because", point.change}});
  }
  for (const bool from_marker : {false, true}) {
    std::vector<double> range;
    std::vector<double> off;
    for (const FlightPoint& point : log.points) {
      if (!point.has_position || point.from_marker != from_marker) continue;
      range.push_back(std::abs(point.range_m / point.true_range_m - 1));
      off.push_back(point.off);
    }
    line[from_marker ? "marker" : "network"] = {{"frames", range.size()},
                                                {"range_error", std::round(quantile(range, 0.5) * 1e5) / 1e5},
                                                {"off", std::round(quantile(off, 0.5) * 1e5) / 1e5}};
  }
  return line;
}

}  // namespace berth::cli
