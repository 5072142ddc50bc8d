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
/// A marker that the whole image's search has read for so many frames is looked for by that search alone. Fewer would
/// search every other frame whole where noise decides which search reads it.
constexpr int kSharpFrames = 8;
/// Frames in flight at the most.
constexpr int kMostBehind = 1024;
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
  /// By expect(): in the next frame, and how far from it the marker may be, px.
  bool is_foretold = false;
  Corners foretold = {};
  double foretold_slack_px = 0;
  /// Frames running, up to kSharpFrames, in which the whole image's search read it without a wrong bit.
  int sharp_frames = 0;
  bool is_seen = false;
};

/// What is known once a frame's result was taken.
struct State {
  std::vector<Held> held;
  FrameStamp last;
  int since_whole = 0;      // frames whose result is of windows
  bool owed = false;        // a whole search
  bool is_crowded = false;  // more were found than are held
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
  check(config.behind >= 1 && config.behind <= kMostBehind, "behind", config.behind, "1 to 1024 frames");
  check(config.behind == 1 || config.same_frame, "behind", config.behind, "1 where same_frame is false");
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
        most_pixels(config.most_share * width * height),
        states(static_cast<std::size_t>(config.behind) + 1) {
    for (State& state : states) state.held.reserve(kMostHeld);
    before.reserve(kMostHeld);
    boxes.reserve(kMostHeld);
    frame.windows.reserve(kMostHeld);
  }

  /// After the n-th frame taken, from 1 on; before the first, nothing is held.
  State& state_after(std::size_t n) {
    return states[(n + static_cast<std::size_t>(config.behind) - 1) % states.size()];
  }
  /// What the next frame's windows go by.
  State& basis() { return states[ordered % states.size()]; }

  /// Seconds from the frame of that state; frames, `behind` of them, where they have no times.
  static double time_to(const FrameStamp& stamp, const State& state, int behind) {
    if (std::string_view(stamp.clock) == "none" || std::string_view(state.last.clock) == "none") return behind;
    return static_cast<double>(stamp.mid_exposure_ns - state.last.mid_exposure_ns) * 1e-9;
  }
  bool is_gap(const FrameStamp& stamp, const State& state) const {
    const double passed = time_to(stamp, state, 1);
    if (std::string_view(stamp.clock) == "none" && std::string_view(state.last.clock) == "none") return false;
    return std::string_view(stamp.clock) != state.last.clock || !(passed > 0) || passed > config.most_gap_s;
  }

  /// Where a marker will be after that time, and how far from it it may be, px.
  Corners expected(const Held& marker, double passed, double& slack_px) const {
    if (marker.is_foretold) {
      slack_px = marker.foretold_slack_px;
      return marker.foretold;
    }
    const Corners corners = moved(marker.corners, marker.velocity, passed);
    const double side = extent(box_of(marker.corners));
    slack_px =
        config.slack_px + config.slack_of_side * side +
        (marker.has_velocity ? config.slack_of_motion * change(marker.corners, corners) : config.slack_unknown * side);
    return corners;
  }

  SearchReason choose(const FrameStamp& stamp, const State& state, std::vector<SearchWindow>& windows) {
    if (state.owed) return SearchReason::lost;
    if (state.held.empty()) return SearchReason::none_held;
    if (is_gap(stamp, state)) return SearchReason::gap;
    if (std::min(windows_since, state.since_whole + config.behind - 1) + 1 >= config.full_every) {
      return SearchReason::regular;
    }
    if (state.is_crowded) return SearchReason::large;
    const double passed = time_to(stamp, state, config.behind);
    boxes.clear();
    for (const Held& marker : state.held) {
      double slack = 0;
      const Box box = box_of(expected(marker, passed, slack));
      boxes.push_back({box.left - slack, box.top - slack, box.right + slack, box.bottom + slack});
    }
    switch (placement.place(boxes, most_pixels, windows)) {
      case Placement::Outcome::placed: {
        const bool all_sharp = std::all_of(state.held.begin(), state.held.end(),
                                           [](const Held& marker) { return marker.sharp_frames == kSharpFrames; });
        for (SearchWindow& window : windows) window.full_resolution_only = all_sharp;
        return SearchReason::held;
      }
      case Placement::Outcome::border:
        return SearchReason::border;
      case Placement::Outcome::large:
        break;
    }
    return SearchReason::large;
  }

  /// Pairs the markers held, in `before`, with those found: each with the nearest of its family and number. No time
  /// `passed`: nothing is known of velocities; nor where a marker was lost and is not where it was expected.
  void match(const std::vector<Detection>& found, double passed, bool was_lost, std::vector<Held>& held) {
    held.clear();
    for (const Detection& detection : found) {
      if (held.size() == kMostHeld) break;
      Held now;
      now.family = detection.family;
      now.id = detection.id;
      now.corners = detection.corners;
      Held* const past = nearest(detection);
      if (past != nullptr) {
        past->is_seen = true;
        double slack = 0;
        const bool jumped = was_lost && change(expected(*past, passed, slack), now.corners) > slack;
        now.has_velocity = passed > 0 && !jumped;
        for (std::size_t i = 0; i < 4 && now.has_velocity; ++i) {
          for (std::size_t axis = 0; axis < 2; ++axis) {
            now.velocity[i][axis] = (now.corners[i][axis] - past->corners[i][axis]) / passed;
          }
        }
      }
      const bool is_sharp = detection.search == 0 && detection.hamming == 0;
      now.sharp_frames = is_sharp ? std::min(kSharpFrames, (past != nullptr ? past->sharp_frames : 0) + 1) : 0;
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
  bool has_all(const std::vector<Detection>& found) {
    const std::vector<Held>& held = state_after(taken).held;
    for (const Held& marker : held) {
      const auto is_it = [&](const auto& other) { return other.family == marker.family && other.id == marker.id; };
      if (std::count_if(found.begin(), found.end(), is_it) < std::count_if(held.begin(), held.end(), is_it))
        return false;
    }
    return true;
  }

  void finish(const SearchOrder& order, const FrameResult& result, SearchReason why) {
    const State& past = state_after(taken);
    State& now = state_after(taken + 1);
    const double passed = is_gap(order.stamp, past) ? 0 : time_to(order.stamp, past, 1);
    before = past.held;
    match(result.detections, passed, !order.tried.empty(), now.held);
    now.is_crowded = result.detections.size() > kMostHeld;
    now.last = order.stamp;
    now.since_whole = order.windows.empty() ? 0 : past.since_whole + 1;
    now.owed = !config.same_frame && (why == SearchReason::lost || why == SearchReason::overflow) &&
               !order.windows.empty() && result.status != FrameStatus::device_lost;
    ++taken;
    frame.result = &result;
    frame.windows = order.windows.empty() ? order.tried : order.windows;
    frame.whole = order.windows.empty();
    frame.why = why;
    frame.held = now.held.size();
    ++counts.frames;
    ++counts.by_reason[static_cast<std::size_t>(why)];
  }

  const TrackerConfig config;
  const Placement placement;
  const double most_pixels;
  /// One more than frames in flight: next() reads one while take() reads another and writes a third.
  std::vector<State> states;
  // next's
  std::vector<Box> boxes;
  std::size_t ordered = 0;
  int windows_since = 0;  // frames ordered to be searched in windows since one was whole
  // take's
  std::vector<Held> before;
  std::size_t taken = 0;
  TrackedFrame frame;
  TrackerCounts counts;
};

Tracker::Tracker(int width, int height, const TrackerConfig& config)
    : impl_(std::make_unique<Impl>(width, height, config)) {
  reserve(order_);
}
Tracker::~Tracker() = default;
Tracker::Tracker(Tracker&&) noexcept = default;
Tracker& Tracker::operator=(Tracker&&) noexcept = default;

void Tracker::reserve(SearchOrder& order) {
  for (auto* windows : {&order.windows, &order.tried}) windows->reserve(kMostHeld);
}

void Tracker::next(const FrameStamp& stamp, SearchOrder& order) {
  Impl& it = *impl_;
  order.stamp = stamp;
  order.tried.clear();
  order.windows.clear();
  order.why = it.choose(stamp, it.basis(), order.windows);
  if (order.why != SearchReason::held) order.windows.clear();
  it.windows_since = order.windows.empty() ? 0 : it.windows_since + 1;
  ++it.ordered;
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
    return true;
  }
  order.tried.swap(order.windows);
  order.windows.clear();
  order.why = why;
  return false;
}

const TrackedFrame& Tracker::frame() const { return impl_->frame; }
const TrackerCounts& Tracker::counts() const { return impl_->counts; }

void Tracker::expect(const MarkerFamily& family, int id, const CameraModel& camera, double size_m,
                     const FilteredPose& pose) {
  if (!pose.has_pose) return;
  for (Held& marker : impl_->basis().held) {
    if (marker.family != &family || marker.id != id) continue;
    const std::array<Vec3, 4> places = corner_places(size_m);
    for (std::size_t i = 0; i < 4; ++i) {
      const Vec3 point = transform(pose.pose, places[i]);
      if (!(point[2] > 0)) return;
      marker.foretold[i] = image_of(camera, point);
    }
    // Three deviations of the corners: by the marker's place, and by its turns at half a diagonal from the middle.
    const std::array<double, 36>& c = pose.covariance;
    const double px_per_m = (camera.fx + camera.fy) / 2 / pose.pose.t[2];
    const double by_place = c[0] + c[7] + c[14], by_turn = (c[21] + c[28] + c[35]) * size_m * size_m / 2;
    marker.foretold_slack_px = impl_->config.slack_px + impl_->config.slack_of_side * extent(box_of(marker.foretold)) +
                               3 * px_per_m * std::sqrt(by_place + by_turn);
    marker.is_foretold = true;
  }
}

void Tracker::reset() {
  Impl& it = *impl_;
  for (State& state : it.states) {
    state.held.clear();
    state.owed = state.is_crowded = false;
    state.since_whole = 0;
  }
  it.ordered = it.taken = 0;
  it.windows_since = 0;
}

}  // namespace berth
