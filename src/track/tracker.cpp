#include "berth/tracker.hpp"

#include <algorithm>
#include <cmath>
#include <string>
#include <string_view>

#include "berth/error.hpp"
#include "pose_algebra.hpp"
#include "track/placement.hpp"

namespace berth {
namespace {

using Corners = std::array<std::array<double, 2>, 4>;

/// Markers held at the same time; a frame with more is searched whole.
constexpr std::size_t kMostHeld = 64;
/// Sides of windows, px: each step up takes 1.2 to 1.6 times the pixels.
constexpr int kSides[] = {64,  80,  96,  112, 128, 144, 160, 176, 192, 208, 224, 256,
                          288, 320, 368, 416, 480, 544, 624, 720, 832, 960, 1104};

/// A marker and where it goes.
struct Held {
  const MarkerFamily* family = nullptr;
  int id = 0;
  Corners corners = {};
  /// Of the corners, px a second (a frame where frames have no times).
  Corners velocity = {};
  bool has_velocity = false;
  /// In the frame at hand, and how far from it the marker may be, px.
  Corners expected = {};
  double slack_px = 0;
  bool is_foretold = false;  // by expect()
  bool is_seen = false;
};

Corners moved(const Corners& corners, const Corners& velocity, double time) {
  Corners result = corners;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t axis = 0; axis < 2; ++axis) result[i][axis] += velocity[i][axis] * time;
  }
  return result;
}

/// The greatest change of a coordinate.
double change(const Corners& a, const Corners& b) {
  double most = 0;
  for (std::size_t i = 0; i < 4; ++i) {
    for (std::size_t axis = 0; axis < 2; ++axis) most = std::max(most, std::fabs(a[i][axis] - b[i][axis]));
  }
  return most;
}

double extent(const Box& box) { return std::max(box.right - box.left, box.bottom - box.top); }

std::vector<int> distinct_sides(int width, int height, const TrackerConfig& config) {
  std::vector<int> sides;
  for (const int side : kSides) {
    const double share = static_cast<double>(side) * side / (static_cast<double>(width) * height);
    if (side <= std::min(width, height) && share <= config.most_share) sides.push_back(side);
  }
  return sides;
}

TrackerConfig checked(const TrackerConfig& config) {
  const auto check = [](bool good, const char* name, double value, const char* remedy) {
    if (!good) throw Error(std::string("tracker: ") + name + " is " + std::to_string(value) + "; give " + remedy);
  };
  check(config.full_every >= 1, "full_every", config.full_every, "1 or more frames");
  check(config.most_windows >= 1 && config.most_windows <= 64, "most_windows", config.most_windows, "1 to 64");
  check(config.most_share > 0 && config.most_share <= 1, "most_share", config.most_share, "a share above 0, at most 1");
  check(config.most_gap_s > 0, "most_gap_s", config.most_gap_s, "seconds above 0");
  check(config.slack_px >= 0, "slack_px", config.slack_px, "0 or more px");
  for (const double share : {config.slack_of_side, config.slack_of_motion, config.slack_unknown}) {
    check(share >= 0, "a slack", share, "a share of 0 or more");
  }
  return config;
}

}  // namespace

const char* name_of(SearchReason reason) {
  switch (reason) {
    case SearchReason::held:
      return "held";
    case SearchReason::none_held:
      return "none_held";
    case SearchReason::regular:
      return "regular";
    case SearchReason::lost:
      return "lost";
    case SearchReason::overflow:
      return "overflow";
    case SearchReason::border:
      return "border";
    case SearchReason::large:
      return "large";
    case SearchReason::gap:
      return "gap";
  }
  return "unknown";
}

std::vector<int> tracking_window_sides(int width, int height, const TrackerConfig& config) {
  std::vector<int> sides;
  for (const int side : distinct_sides(width, height, checked(config))) {
    for (int k = 0; k < config.most_windows; ++k) {
      const double pixels = static_cast<double>(side) * side * (k + 1);
      if (pixels <= config.most_share * width * height) sides.push_back(side);
    }
  }
  return sides;
}

struct Tracker::Impl {
  Impl(int width, int height, const TrackerConfig& wanted)
      : config(checked(wanted)),
        placement(width, height, distinct_sides(width, height, config), config.most_windows),
        most_pixels(config.most_share * width * height) {
    held.reserve(kMostHeld);
    before.reserve(kMostHeld);
    boxes.reserve(kMostHeld);
    frame.windows.reserve(kMostHeld);
  }

  /// Seconds since the last frame; frames where they have no times.
  double time_to(const FrameStamp& stamp) const {
    if (std::string_view(stamp.clock) == "none" || std::string_view(last.clock) == "none") return 1;
    return static_cast<double>(stamp.mid_exposure_ns - last.mid_exposure_ns) * 1e-9;
  }
  bool is_gap(const FrameStamp& stamp) const {
    const double passed = time_to(stamp);
    if (std::string_view(stamp.clock) == "none" && std::string_view(last.clock) == "none") return false;
    return std::string_view(stamp.clock) != last.clock || !(passed > 0) || passed > config.most_gap_s;
  }

  void expect_all(double passed) {
    for (Held& marker : held) {
      if (marker.is_foretold) continue;
      marker.expected = moved(marker.corners, marker.velocity, passed);
      const double side = extent(box_of(marker.corners));
      marker.slack_px = config.slack_px + config.slack_of_side * side +
                        (marker.has_velocity ? config.slack_of_motion * change(marker.corners, marker.expected)
                                             : config.slack_unknown * side);
    }
  }

  SearchReason choose(const FrameStamp& stamp, std::vector<SearchWindow>& windows) {
    if (owed) return SearchReason::lost;
    if (held.empty()) return SearchReason::none_held;
    if (is_gap(stamp)) return SearchReason::gap;
    if (since_whole + 1 >= config.full_every) return SearchReason::regular;
    if (is_crowded) return SearchReason::large;
    expect_all(time_to(stamp));
    boxes.clear();
    for (const Held& marker : held) {
      const Box box = box_of(marker.expected);
      const double s = marker.slack_px;
      boxes.push_back({box.left - s, box.top - s, box.right + s, box.bottom + s});
    }
    switch (placement.place(boxes, most_pixels, windows)) {
      case Placement::Outcome::placed:
        return SearchReason::held;
      case Placement::Outcome::border:
        return SearchReason::border;
      case Placement::Outcome::large:
        break;
    }
    return SearchReason::large;
  }

  /// Pairs the markers held with those found: each with the nearest of its family and number. No time `passed`: nothing
  /// is known of velocities; nor where a marker was lost and is not where it was expected.
  void match(const std::vector<Detection>& found, double passed, bool was_lost) {
    before.swap(held);
    held.clear();
    is_crowded = found.size() > kMostHeld;
    for (const Detection& detection : found) {
      if (held.size() == kMostHeld) break;
      Held now;
      now.family = detection.family;
      now.id = detection.id;
      now.corners = detection.corners;
      Held* const past = nearest(detection);
      if (past != nullptr) {
        past->is_seen = true;
        const bool jumped = was_lost && change(past->expected, now.corners) > past->slack_px;
        now.has_velocity = passed > 0 && !jumped;
        for (std::size_t i = 0; i < 4 && now.has_velocity; ++i) {
          for (std::size_t axis = 0; axis < 2; ++axis) {
            now.velocity[i][axis] = (now.corners[i][axis] - past->corners[i][axis]) / passed;
          }
        }
      }
      held.push_back(now);
    }
  }
  Held* nearest(const Detection& detection) {
    Held* best = nullptr;
    double least = 0;
    for (Held& marker : before) {
      if (marker.is_seen || marker.family != detection.family || marker.id != detection.id) continue;
      const double distance = change(marker.corners, detection.corners);
      if (best != nullptr && distance >= least) continue;
      best = &marker;
      least = distance;
    }
    return best;
  }
  /// Whether a frame has every marker that is held: as many of each family and number.
  bool has_all(const std::vector<Detection>& found) const {
    for (const Held& marker : held) {
      const auto is_it = [&](const auto& other) { return other.family == marker.family && other.id == marker.id; };
      if (std::count_if(found.begin(), found.end(), is_it) < std::count_if(held.begin(), held.end(), is_it))
        return false;
    }
    return true;
  }

  void finish(const SearchOrder& order, const FrameResult& result, SearchReason why) {
    match(result.detections, is_gap(order.stamp) ? 0 : time_to(order.stamp), !order.tried.empty());
    last = order.stamp;
    frame.result = &result;
    frame.windows = order.windows.empty() ? order.tried : order.windows;
    frame.whole = order.windows.empty();
    frame.why = why;
    frame.held = held.size();
    ++counts.frames;
    ++counts.by_reason[static_cast<std::size_t>(why)];
  }

  TrackerConfig config;
  Placement placement;
  double most_pixels;
  std::vector<Held> held, before;
  std::vector<Box> boxes;
  TrackedFrame frame;
  TrackerCounts counts;
  FrameStamp last;          // taken
  int since_whole = 0;      // frames ordered to be searched in windows since
  bool owed = false;        // a whole search, from the frame before
  bool is_crowded = false;  // more were found than are held
};

Tracker::Tracker(int width, int height, const TrackerConfig& config)
    : impl_(std::make_unique<Impl>(width, height, config)) {
  for (auto* windows : {&order_.windows, &order_.tried}) windows->reserve(kMostHeld);
}
Tracker::~Tracker() = default;
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;

void Tracker::next(const FrameStamp& stamp, SearchOrder& order) {
  Impl& it = *impl_;
  order.stamp = stamp;
  order.tried.clear();
  order.windows.clear();
  order.why = it.choose(stamp, order.windows);
  if (order.why != SearchReason::held) order.windows.clear();
  it.since_whole = order.windows.empty() ? 0 : it.since_whole + 1;
  it.owed = false;
}

bool Tracker::take(SearchOrder& order, const FrameResult& result) {
  Impl& it = *impl_;
  if (order.windows.empty()) {
    it.finish(order, result, order.why);
    return true;
  }
  // Nothing more can be searched.
  if (result.status == FrameStatus::device_lost) {
    it.finish(order, result, SearchReason::lost);
    return true;
  }
  const bool full = result.status == FrameStatus::overflow;
  if (!full && it.has_all(result.detections)) {
    it.finish(order, result, SearchReason::held);
    return true;
  }
  const SearchReason why = full ? SearchReason::overflow : SearchReason::lost;
  if (!it.config.same_frame) {
    it.finish(order, result, why);
    it.owed = true;
    return true;
  }
  order.tried.swap(order.windows);
  order.windows.clear();
  order.why = why;
  it.since_whole = 0;
  return false;
}

const TrackedFrame& Tracker::frame() const { return impl_->frame; }
const TrackerCounts& Tracker::counts() const { return impl_->counts; }

void Tracker::expect(const MarkerFamily& family, int id, const CameraModel& camera, double size_m,
                     const FilteredPose& pose) {
  if (!pose.has_pose) return;
  for (Held& marker : impl_->held) {
    if (marker.family != &family || marker.id != id) continue;
    const std::array<Vec3, 4> places = corner_places(size_m);
    for (std::size_t i = 0; i < 4; ++i) {
      const Vec3 point = transform(pose.pose, places[i]);
      if (!(point[2] > 0)) return;
      marker.expected[i] = image_of(camera, point);
    }
    // Three deviations of the corners: by the marker's place, and by its turns at half a diagonal from the middle.
    const std::array<double, 36>& c = pose.covariance;
    const double px_per_m = (camera.fx + camera.fy) / 2 / pose.pose.t[2];
    const double by_place = c[0] + c[7] + c[14], by_turn = (c[21] + c[28] + c[35]) * size_m * size_m / 2;
    marker.slack_px = impl_->config.slack_px + impl_->config.slack_of_side * extent(box_of(marker.expected)) +
                      3 * px_per_m * std::sqrt(by_place + by_turn);
    marker.is_foretold = true;
  }
}

void Tracker::reset() {
  impl_->held.clear();
  impl_->owed = false;
}

}  // namespace berth
