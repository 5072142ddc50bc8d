#include "survey/start.hpp"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "target/refine_pose.hpp"

namespace berth {
namespace {

// Corners further off than this say that something is wrong, not how wrong it is, px.
constexpr double kWrong_px = 3;
// A placement is compared in so many frames: as many as tell a plane's two poses apart, not all of a video.
constexpr std::size_t kMostJudges = 16;
// Sizes that are free are looked for in these steps, up to so many times as large and as small as said.
constexpr double kFactorStep = 1.05, kMostFactor = 1.5;
// Of a corner, px: here it only makes all corners equal.
constexpr double kAnyDeviation_px = 0.3;

using Poses = std::vector<Pose>;

// What the pieces below share: every sight with the poses its marker may have.
struct Either {
  const Sight* sight;
  /// Marker to camera: none, one, or both of a plane.
  Poses poses;
  double area_px2;
};
using Views = std::vector<std::vector<Either>>;  // of each station

double area_of(const std::array<Vec2, 4>& c) {
  const double ax = c[2][0] - c[0][0], ay = c[2][1] - c[0][1], bx = c[3][0] - c[1][0], by = c[3][1] - c[1][1];
  return std::fabs(ax * by - ay * bx) / 2;
}

Views views_of(const SurveyNet& net) {
  Views views;
  for (const SurveyStation& station : net.stations) {
    std::vector<Either>& view = views.emplace_back();
    for (const Sight& sight : station.sights) {
      Either either = {&sight, {}, area_of(sight.seen_px)};
      Pose pose;
      PoseUncertainty uncertainty;
      if (marker_pose(net.camera, net.markers[sight.marker].size_m, kAnyDeviation_px, sight.seen_px, pose,
                      uncertainty)) {
        either.poses.push_back(pose);
        if (uncertainty.has_other) either.poses.push_back(uncertainty.other);
      }
      view.push_back(std::move(either));
    }
  }
  return views;
}

const Either* sight_of(const std::vector<Either>& view, std::size_t marker) {
  for (const Either& either : view) {
    if (either.sight->marker == marker) return &either;
  }
  return nullptr;
}

// Corners of a marker `factor` times as large as assumed that sits at `place` in the frame whose pose is sought.
void add_corners(const SurveyNet& net, const Either& either, const Pose& place, double factor,
                 std::vector<PoseCorner>& corners) {
  const double variance = kAnyDeviation_px * kAnyDeviation_px;
  const std::array<Vec3, 4> places = corner_places(factor * net.markers[either.sight->marker].size_m);
  for (std::size_t k = 0; k < 4; ++k) {
    corners.push_back({transform(place, places[k]), either.sight->seen_px[k], {variance, 0, variance}});
  }
}

// A frame that shows two markers.
struct Shared {
  const Either* a;
  const Either* b;
  double weight;
};

// Where b is in a's frame, and how many times as large as assumed.
struct Place {
  Pose pose;
  double factor = 1;
};

// How badly the frame fits with b there: at best 0, at worst kWrong_px squared.
double misfit(const SurveyNet& net, const Shared& shared, const Place& place) {
  std::vector<PoseCorner> corners;
  add_corners(net, *shared.a, Pose{}, 1, corners);
  add_corners(net, *shared.b, place.pose, place.factor, corners);
  double least = kWrong_px * kWrong_px;
  for (const Pose& start : shared.a->poses) {
    RefinedPose refined;
    if (!refine_pose(net.camera, corners.data(), corners.size(), start, refined)) continue;
    least = std::min(least, refined.error_px * refined.error_px);
  }
  return least;
}

// Of a marker whose size is not known: near enough for the adjustment to find the rest of the way.
std::vector<double> factors_tried(bool free_sizes) {
  if (!free_sizes) return {1};
  std::vector<double> factors = {1};
  for (double factor = kFactorStep; factor < kMostFactor; factor *= kFactorStep) {
    factors.push_back(factor);
    factors.push_back(1 / factor);
  }
  return factors;
}

// b in a's frame as most of the frames have it.
Place agreed_place(const SurveyNet& net, std::vector<Shared> shared, bool free_sizes) {
  if (shared.size() > kMostJudges) {  // evenly through time, as the camera moves
    std::vector<Shared> fewer;
    for (std::size_t k = 0; k < kMostJudges; ++k) fewer.push_back(shared[k * shared.size() / kMostJudges]);
    shared = std::move(fewer);
  }
  Place best;
  double least = std::numeric_limits<double>::infinity();
  const auto judge = [&](const Pose& a, const Pose& b, double factor) {
    Pose further = b;
    further.t = scaled(b.t, factor);  // a larger marker further away gives the same image
    const Place place = {compose(inverse(a), further), factor};
    double sum = 0;
    for (std::size_t k = 0; k < shared.size() && sum < least; ++k) sum += misfit(net, shared[k], place);
    if (sum < least) {
      least = sum;
      best = place;
    }
  };
  for (const double factor : factors_tried(free_sizes)) {
    for (const Shared& source : shared) {
      for (const Pose& a : source.a->poses) {
        for (const Pose& b : source.b->poses) judge(a, b, factor);
      }
    }
  }
  return best;
}

std::vector<Shared> shared_by(const Views& views, std::size_t a, std::size_t b) {
  std::vector<Shared> shared;
  for (const std::vector<Either>& view : views) {
    const Either *first = sight_of(view, a), *second = sight_of(view, b);
    if (first == nullptr || second == nullptr || first->poses.empty() || second->poses.empty()) continue;
    shared.push_back({first, second, std::min(first->area_px2, second->area_px2)});
  }
  return shared;
}

// Prim's: from the origin on, always along the pair that shows most, in squares of pixels, of both.
void place_markers(SurveyNet& net, const Views& views, bool free_sizes) {
  const std::size_t count = net.markers.size();
  std::vector<double> weight(count * count);
  for (std::size_t a = 0; a < count; ++a) {
    for (std::size_t b = 0; b < a; ++b) {
      const std::vector<Shared> shared = shared_by(views, a, b);
      if (shared.size() < static_cast<std::size_t>(kLeastTogether)) continue;
      double sum = 0;
      for (const Shared& each : shared) sum += each.weight;
      weight[a * count + b] = weight[b * count + a] = sum;
    }
  }
  std::vector<bool> placed(count);
  std::vector<double> factors(count, 1);
  placed[net.origin] = true;
  net.markers[net.origin].pose = {};
  for (std::size_t done = 1; done < count; ++done) {
    std::size_t from = 0, to = 0;
    double most = 0;
    for (std::size_t a = 0; a < count; ++a) {
      for (std::size_t b = 0; b < count; ++b) {
        if (!placed[a] || placed[b] || !(weight[a * count + b] > most)) continue;
        most = weight[a * count + b];
        from = a;
        to = b;
      }
    }
    if (!(most > 0)) break;
    // The factor is between the two: what is known of the one's holds for the other's.
    const Place place = agreed_place(net, shared_by(views, from, to), free_sizes);
    const double outer = factors[from];
    Pose inner = place.pose;
    inner.t = scaled(inner.t, outer);
    net.markers[to].pose = compose(net.markers[from].pose, inner);
    factors[to] = outer * place.factor;
    placed[to] = true;
  }
  for (std::size_t m = 0; m < count; ++m) net.markers[m].size_m *= factors[m];
}

// The sight's mean square residual, px^2, or what is wrong enough.
double misfit(const SurveyNet& net, const SurveyStation& station, const Sight& sight) {
  double sum = 0;
  for (std::size_t k = 0; k < 4; ++k) {
    Vec2 off{};
    if (!residual(net, station, sight, k, off)) return std::numeric_limits<double>::infinity();
    sum += off[0] * off[0] + off[1] * off[1];
  }
  return sum / 4;
}

// The camera that most of the frame's markers agree about. Those that do are some hundredths of their size off at most.
bool place_camera(const SurveyNet& net, const std::vector<Either>& view, SurveyStation& station) {
  std::optional<Pose> best;
  double least = std::numeric_limits<double>::infinity();
  const auto tolerance = [](const Either& either) { return std::max(kWrong_px * kWrong_px, 0.01 * either.area_px2); };
  for (const Either& from : view) {
    for (const Pose& pose : from.poses) {
      SurveyStation tried = station;
      tried.camera = compose(pose, inverse(net.markers[from.sight->marker].pose));
      double sum = 0;
      for (const Either& either : view) {
        const double worst = tolerance(either);
        sum += std::min(misfit(net, tried, *either.sight) / worst, 1.0);
      }
      if (sum < least) {
        least = sum;
        best = tried.camera;
      }
    }
  }
  if (!best) return false;
  station.camera = *best;
  std::vector<PoseCorner> corners;
  for (const Either& either : view) {
    if (misfit(net, station, *either.sight) < tolerance(either)) {
      add_corners(net, either, net.markers[either.sight->marker].pose, 1, corners);
    }
  }
  RefinedPose refined;
  if (!corners.empty() && refine_pose(net.camera, corners.data(), corners.size(), station.camera, refined)) {
    station.camera = refined.pose;
  }
  return true;
}

}  // namespace

void start_net(SurveyNet& net, bool free_sizes) {
  Views views = views_of(net);
  place_markers(net, views, free_sizes);
  if (free_sizes) views = views_of(net);
  for (std::size_t s = 0; s < net.stations.size(); ++s) {
    SurveyStation& station = net.stations[s];
    if (!place_camera(net, views[s], station)) station.sights.clear();  // its view is not looked at again
  }
}

}  // namespace berth
