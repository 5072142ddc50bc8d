#include "target/bundle_pose.hpp"

#include <algorithm>
#include <cmath>
#include <utility>

#include "pose_algebra.hpp"
#include "target/carry_pose.hpp"
#include "target/marker_pose.hpp"
#include "target/symmetric.hpp"

namespace berth {
namespace {

// Of a corner behind the camera: beyond every bound, and still to be added up.
constexpr double kBehind = 1e30;
constexpr double kNearest_m = 1e-6;
// Half of chi-square with two degrees of freedom lie below 2 ln 2.
constexpr double kMedian = 1.3863;
// Markers whose own poses are tried as starts.
constexpr std::size_t kMostStarts = 8;
// Rounds of reweighting: by then what does not fit has lost its weight (measured: no more came of 20).
constexpr int kRounds = 8;
// Corners as far as this share of their reach before or behind a plane tell by themselves how it is tilted.
constexpr double kFlat = 0.1;

double squares_off(const CameraModel& camera, const Pose& pose, const PoseCorner& corner) {
  const Vec3 at = transform(pose, corner.point_m);
  if (!(at[2] > kNearest_m)) return kBehind;
  const Vec2 image = image_of(camera, at);
  const double squares =
      whitened_square({corner.seen_px[0] - image[0], corner.seen_px[1] - image[1]}, corner.covariance_px2);
  return squares < kBehind ? squares : kBehind;
}

// The same one in a million of chi-square with many degrees of freedom (Cornish and Fisher's expansion, to the skew).
double sum_bound(double freedom) {
  constexpr double kNormal = 4.753;
  return freedom + kNormal * std::sqrt(2 * freedom) + (kNormal * kNormal - 1) * 2 / 3;
}

// What a plane seen in direction `line` through it becomes when depths along the line change sign: the other of the two
// poses that a plane seen from far away may have. A rotation again, since the plane is mirrored in itself too.
Mat3 tilted_the_other_way(const Mat3& r, const Vec3& line, const Vec3& normal) {
  Mat3 in_view{}, in_plane{};
  for (std::size_t i = 0; i < 3; ++i) {
    for (std::size_t j = 0; j < 3; ++j) {
      const double one = i == j ? 1 : 0;
      in_view[3 * i + j] = one - 2 * line[i] * line[j];
      in_plane[3 * i + j] = one - 2 * normal[i] * normal[j];
    }
  }
  return product(in_view, product(r, in_plane));
}

}  // namespace

BundlePoser::BundlePoser(const Bundle& bundle) : bundle_(bundle) {
  bundle_.check();
  const std::size_t most = kMostSightings * bundle_.markers.size();
  sightings_.reserve(most);
  largest_.reserve(most);
  corners_.reserve(4 * most);
  fitted_.reserve(most);
  squares_.reserve(4 * most);
  sorted_.reserve(4 * most);
  in_.reserve(4 * most);
}

void BundlePoser::find(const CameraModel& camera, const std::vector<Detection>& detections, double corner_deviation_px,
                       BundlePose& result) {
  result = {};
  const int spare = gather(detections, corner_deviation_px);
  result.kept_out = spare + static_cast<int>(sightings_.size());
  Pose start;
  std::size_t from = 0;
  RefinedPose found;
  if (!best_start(camera, start, from) || !solve(camera, start, from, found)) return;
  RefinedPose other;
  bool has_other = other_of(camera, found, other);
  if (has_other && other.chi_square < found.chi_square) {
    // The start was the wrong one of two: what fits is judged again from the right one.
    if (!solve(camera, other.pose, from, found) && !solve(camera, start, from, found)) return;
    has_other = other_of(camera, found, other);
    if (has_other && other.chi_square < found.chi_square) std::swap(found, other);
  }
  if (has_other) other = from_origin(other);
  report(from_origin(found), has_other ? &other : nullptr, result);
  result.kept_out += spare;
}

// Returns how many sightings there was no room for.
int BundlePoser::gather(const std::vector<Detection>& detections, double corner_deviation_px) {
  sightings_.clear();
  corners_.clear();
  centre_ = {};
  int spare = 0;
  for (const Detection& detection : detections) {
    const BundleMarker* marker = bundle_.find(*detection.family, detection.id);
    if (marker == nullptr) continue;
    const auto before = std::count_if(sightings_.begin(), sightings_.end(),
                                      [&](const Sighting& sighting) { return sighting.marker == marker; });
    if (before == kMostSightings) {
      ++spare;
      continue;
    }
    add_sighting(*marker, detection, corner_deviation_px);
    centre_ = add(centre_, marker->pose.t);
  }
  if (sightings_.empty()) return spare;
  centre_ = scaled(centre_, 1 / static_cast<double>(sightings_.size()));
  for (PoseCorner& corner : corners_) corner.point_m = add(corner.point_m, scaled(centre_, -1));
  squares_.assign(corners_.size(), 0);
  in_.assign(corners_.size(), 1);
  return spare;
}

void BundlePoser::add_sighting(const BundleMarker& marker, const Detection& detection, double corner_deviation_px) {
  double sides_px2 = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    const Vec2 &a = detection.corners[i], &b = detection.corners[(i + 1) % 4];
    sides_px2 += (a[0] - b[0]) * (a[0] - b[0]) + (a[1] - b[1]) * (a[1] - b[1]);
  }
  // What the place's deviation amounts to in the image, where the marker is seen at that size.
  const double pixels = bundle_.deviation_m / marker.size_m;
  const double place_px2 = pixels * pixels * sides_px2 / 4;
  CornerCovariance covariance = corner_covariance(detection, corner_deviation_px);
  for (std::size_t i = 0; i < 8; ++i) covariance[9 * i] += place_px2;
  sightings_.push_back({&marker, &detection, sides_px2, covariance});
  const std::array<Vec3, 4> places = corner_places(marker.size_m);
  for (std::size_t i = 0; i < 4; ++i) {
    corners_.push_back({transform(marker.pose, places[i]), detection.corners[i], block_of(covariance, i)});
  }
}

// The bundle's pose that a marker's own gives, about the centre.
Pose BundlePoser::centred(const Pose& marker_pose, const BundleMarker& marker) const {
  Pose pose = compose(marker_pose, inverse(marker.pose));
  pose.t = transform(pose, centre_);
  return pose;
}

// Of the poses that the largest markers may have by themselves, the one whose corners are off least, as a sum of
// distances and not of squares: a marker out of place does not decide it.
bool BundlePoser::best_start(const CameraModel& camera, Pose& start, std::size_t& from) {
  largest_.clear();
  for (std::size_t i = 0; i < sightings_.size(); ++i) {
    if (sightings_[i].detection->has_pose) largest_.push_back(i);
  }
  const std::size_t count = std::min(kMostStarts, largest_.size());
  std::partial_sort(largest_.begin(), largest_.begin() + static_cast<std::ptrdiff_t>(count), largest_.end(),
                    [&](std::size_t a, std::size_t b) {
                      const double x = sightings_[a].sides_px2, y = sightings_[b].sides_px2;
                      return x > y || (x == y && a < b);
                    });
  double least = 0;
  bool found = false;
  const auto attempt = [&](const Pose& own, std::size_t index) {
    const Pose pose = centred(own, *sightings_[index].marker);
    const double sum = evaluate(camera, pose);
    if (found && !(sum < least)) return;
    found = true;
    least = sum;
    start = pose;
    from = index;
  };
  for (std::size_t k = 0; k < count; ++k) {
    const Detection& detection = *sightings_[largest_[k]].detection;
    attempt(detection.pose, largest_[k]);
    if (detection.pose_uncertainty && detection.pose_uncertainty->has_other) {
      attempt(detection.pose_uncertainty->other, largest_[k]);
    }
  }
  return found;
}

// Fills the squares; returns the sum of the corners' distances in standard deviations.
double BundlePoser::evaluate(const CameraModel& camera, const Pose& pose) {
  double sum = 0;
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    squares_[i] = squares_off(camera, pose, corners_[i]);
    sum += std::sqrt(squares_[i]);
  }
  return sum;
}

// The bound at the pose last evaluated: where half of the corners are off by more than their covariances say, those
// are too small for what the bundle is, and the bound grows with them.
double BundlePoser::limit() {
  sorted_.assign(squares_.begin(), squares_.end());
  const auto middle = sorted_.begin() + static_cast<std::ptrdiff_t>((sorted_.size() - 1) / 2);
  std::nth_element(sorted_.begin(), middle, sorted_.end());
  return kBound * std::max(1.0, *middle / kMedian);
}

// False where nothing is left.
bool BundlePoser::take_within(double bound) {
  for (std::size_t i = 0; i < corners_.size(); ++i) in_[i] = squares_[i] <= bound ? 1 : 0;
  return keep_markers_whole();
}

// A marker of which two corners do not fit goes out with the others. False where nothing is left.
bool BundlePoser::keep_markers_whole() {
  bool any = false;
  for (std::size_t i = 0; i < in_.size(); i += 4) {
    if (in_[i] + in_[i + 1] + in_[i + 2] + in_[i + 3] < 3) in_[i] = in_[i + 1] = in_[i + 2] = in_[i + 3] = 0;
    any = any || in_[i] + in_[i + 1] > 0;
  }
  return any;
}

// Least squares of the corners that are in. With a soft bound each weighs the less the more it is off at the pose last
// evaluated (Geman and McClure's weights).
bool BundlePoser::fit(const CameraModel& camera, const Pose& start, RefinedPose& result, double soft_bound) {
  fitted_.clear();
  for (std::size_t first = 0; first < corners_.size(); first += 4) {
    const CornerCovariance& all = sightings_[first / 4].covariance_px2;
    SeenCorners seen;
    std::array<std::size_t, 4> which{};
    std::array<double, 4> by{};
    for (std::size_t i = 0; i < 4; ++i) {
      if (in_[first + i] == 0) continue;
      which[seen.count] = i;
      by[seen.count] = soft_bound > 0 ? 1 + squares_[first + i] / soft_bound : 1;
      seen.points_m[seen.count] = corners_[first + i].point_m;
      seen.seen_px[seen.count++] = corners_[first + i].seen_px;
    }
    if (seen.count == 0) continue;
    CornerCovariance covariance{};
    for (std::size_t i = 0; i < 2 * seen.count; ++i) {
      for (std::size_t j = 0; j <= i; ++j) {
        covariance[8 * i + j] = by[i / 2] * by[j / 2] * all[8 * (2 * which[i / 2] + i % 2) + 2 * which[j / 2] + j % 2];
      }
    }
    if (!seen.set_covariance(covariance)) return false;
    fitted_.push_back(seen);
  }
  return refine_pose(camera, fitted_.data(), fitted_.size(), start, result);
}

bool BundlePoser::solve(const CameraModel& camera, const Pose& start, std::size_t from, RefinedPose& result) {
  evaluate(camera, start);
  const bool all_before = take_within(kBehind / 2);
  if (all_before && fit(camera, start, result)) {
    evaluate(camera, result.pose);
    // Of their sum too: a marker a little out of place may pull the others along until each is within its bound.
    const bool all_fit =
        result.chi_square <= sum_bound(2 * static_cast<double>(corners_.size()) - 6) &&
        std::all_of(squares_.begin(), squares_.end(), [](double squares) { return squares <= kBound; });
    if (all_fit || sightings_.size() == 1) return true;  // nothing tells that a single marker is wrong
  }
  if (solve_robustly(camera, start, result)) return true;
  std::fill(in_.begin(), in_.end(), static_cast<unsigned char>(0));
  std::fill_n(in_.begin() + static_cast<std::ptrdiff_t>(4 * from), 4, static_cast<unsigned char>(1));
  return fit(camera, start, result);
}

bool BundlePoser::solve_robustly(const CameraModel& camera, const Pose& start, RefinedPose& result) {
  Pose pose = start;
  for (int round = 0; round < kRounds; ++round) {
    evaluate(camera, pose);
    if (!take_within(kBehind / 2) || !fit(camera, pose, result, limit())) return false;
    pose = result.pose;
  }
  // Twice, since some that are beyond the bound at the weighted pose are within it at that of those that fit.
  for (int pass = 0; pass < 2; ++pass) {
    evaluate(camera, pose);
    if (!take_within(limit()) || !fit(camera, pose, result)) return false;
    pose = result.pose;
  }
  while (true) {
    evaluate(camera, pose);
    const double bound = limit();
    std::size_t worst = corners_.size();
    for (std::size_t i = 0; i < corners_.size(); ++i) {
      if (in_[i] != 0 && squares_[i] > bound && (worst == corners_.size() || squares_[i] > squares_[worst])) worst = i;
    }
    if (worst == corners_.size()) return true;
    in_[worst] = 0;
    if (!keep_markers_whole() || !fit(camera, pose, result)) return false;
    pose = result.pose;
  }
}

// The start of the other pose, where the corners that are in lie nearly in a plane.
bool BundlePoser::mirrored(const Pose& pose, Pose& start) const {
  Vec3 normal = {}, middle = {};
  double count = 0;
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    if (in_[i] == 0) continue;
    normal = add(normal, column(sightings_[i / 4].marker->pose.R, 2));
    middle = add(middle, corners_[i].point_m);
    ++count;
  }
  if (!(dot(normal, normal) > 0.25 * count * count)) return false;
  normal = normalized(normal);
  middle = scaled(middle, 1 / count);
  double reach = 0, height = 0;
  for (std::size_t i = 0; i < corners_.size(); ++i) {
    if (in_[i] == 0) continue;
    const Vec3 arm = add(corners_[i].point_m, scaled(middle, -1));
    reach = std::max(reach, length(arm));
    height = std::max(height, std::fabs(dot(arm, normal)));
  }
  if (height > kFlat * reach) return false;
  const Vec3 at = transform(pose, middle);
  start.R = tilted_the_other_way(pose.R, normalized(at), normal);
  start.t = add(at, scaled(product(start.R, middle), -1));
  return true;
}

bool BundlePoser::other_of(const CameraModel& camera, const RefinedPose& found, RefinedPose& other) {
  Pose start;
  if (!mirrored(found.pose, start) || !fit(camera, start, other) || same_pose(found, other)) return false;
  for (std::size_t i = 0; i < sightings_.size(); ++i) {
    Pose in_bundle = sightings_[i].marker->pose;
    in_bundle.t = add(in_bundle.t, scaled(centre_, -1));
    if (in_[4 * i] + in_[4 * i + 1] > 0 && !faces_camera(compose(other.pose, in_bundle))) return false;
  }
  return true;
}

RefinedPose BundlePoser::from_origin(const RefinedPose& pose) const {
  return compose(pose, translation(-centre_[0], -centre_[1], -centre_[2]));
}

void BundlePoser::report(const RefinedPose& found, const RefinedPose* other, BundlePose& result) const {
  result.has_pose = true;
  result.pose = found.pose;
  result.uncertainty = uncertainty_of(found, other);
  result.used = result.kept_out = result.corners_kept_out = 0;
  int corners = 0;
  for (std::size_t i = 0; i < in_.size(); i += 4) {
    const int kept = in_[i] + in_[i + 1] + in_[i + 2] + in_[i + 3];
    corners += kept;
    if (kept == 0) {
      ++result.kept_out;
    } else {
      ++result.used;
      result.corners_kept_out += 4 - kept;
    }
  }
  // Two markers or more tell when the covariances are too small for what the bundle is.
  const double spread = result.used > 1 ? found.chi_square / (2 * corners - 6) : 1;
  for (double& value : result.uncertainty.covariance) value *= std::max(1.0, spread);
}

}  // namespace berth
