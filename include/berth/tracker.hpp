#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <vector>

#include "berth/detector.hpp"
#include "berth/pose_filter.hpp"

namespace berth {

/// Why a frame was searched as it was: in windows (`held`), or whole.
enum class SearchReason {
  held,       ///< Every marker held was found in its window.
  none_held,  ///< No marker was held.
  regular,    ///< So many frames since the last whole search: markers that are not held may have come.
  lost,       ///< A marker held was not where its window said, or the device was lost while windows were searched.
  overflow,   ///< A window's lists ran full.
  border,     ///< A marker held is too near the image's border for a window around it.
  large,      ///< The windows would save too little.
  gap,        ///< The frames' times say that too much time has passed, or that it ran backwards.
};
constexpr std::size_t kSearchReasons = 8;
const char* name_of(SearchReason reason);

struct TrackerConfig {
  /// Frames from one whole search to the next at the most, for markers that are not held yet.
  int full_every = 30;
  /// Windows in a frame at the most; where more would be needed, some are joined.
  int most_windows = 4;
  /// Windows are given up for the whole frame beyond this share of its pixels.
  double most_share = 0.5;
  /// No window without a frame since, s.
  double most_gap_s = 0.25;
  /// A frame whose windows lack a marker is searched whole in the same call. False: the next one is, for deadlines
  /// that have no room for both.
  bool same_frame = true;
  /// A frame's windows go by the result of the frame so many before it: 1 follows frame by frame. Where several are in
  /// flight, as many as may be before a result is there: later results do not count even where they came in time, so
  /// that the same frames have the same searches. More than 1 needs same_frame.
  int behind = 1;
  /// How far a marker may be from where it is expected: px, and shares of its side and of how far it moved since the
  /// frame before; the first share again where that is not known yet.
  double slack_px = 4;
  double slack_of_side = 0.04;
  double slack_of_motion = 0.5;
  double slack_unknown = 0.25;
};

/// The sides of the windows that a tracker uses in frames of this size, each as often as it may: what
/// DetectorConfig::window_sides must hold.
std::vector<int> tracking_window_sides(int width, int height, const TrackerConfig& config = {});

/// Where a frame is to be searched.
struct SearchOrder {
  FrameStamp stamp;
  /// None: everywhere.
  std::vector<SearchWindow> windows;
  /// Those that were searched in vain.
  std::vector<SearchWindow> tried;
  SearchReason why = SearchReason::none_held;
};

/// One frame, searched in windows or whole.
struct TrackedFrame {
  /// Its `times` are of the search that it is of: of a frame searched again whole, of that search alone.
  const FrameResult* result = nullptr;
  /// The windows that were searched, in vain where `whole` is true as well.
  std::vector<SearchWindow> windows;
  /// Whether the whole frame was searched, and the result is of that. False with `lost` or `overflow`: the next frame
  /// is (same_frame), or the device is lost (the result's status).
  bool whole = true;
  SearchReason why = SearchReason::none_held;
  /// Markers held after the frame.
  std::size_t held = 0;
};

/// What a tracker has done, frame by frame.
struct TrackerCounts {
  std::size_t frames = 0;
  /// By the reason given for the frame; [held] are those searched in windows alone.
  std::array<std::size_t, kSearchReasons> by_reason = {};
};

/// After a marker is found, searches only where it must be (docs/tracking.md). A tracker decides by the frames' results
/// and times and by nothing else, so a recording replays to the same searches. Takes all its memory when it is made.
///
/// look() runs a frame. What keeps several in flight has an order in each slot: next() fills it before the frame is
/// submitted, take() reads it, in the frames' order, when the result is there. The two may be called by two threads, as
/// long as the result of the frame `TrackerConfig::behind` before has been taken, and the one thread knows it of the
/// other, before a frame's next(); expect() belongs to next()'s thread and then needs `behind` 1.
class Tracker {
 public:
  /// For frames of that size. Throws Error on a configuration out of bounds.
  Tracker(int width, int height, const TrackerConfig& config = {});
  ~Tracker();
  Tracker(Tracker&&) noexcept;
  Tracker& operator=(Tracker&&) noexcept;

  /// Searches a frame with `detector` (Detector, FailoverDetector, Lockstep), which was made with the windows of
  /// tracking_window_sides. Valid until the next call.
  template <class AnyDetector>
  const TrackedFrame& look(AnyDetector& detector, View2D<const u8> image, const FrameStamp& stamp = {}) {
    next(stamp, order_);
    while (!take(order_, detector.detect(image, stamp, order_.windows))) {
    }
    return frame();
  }

  /// Gives an order the room it needs: next() and take() then allocate nothing.
  static void reserve(SearchOrder& order);
  /// Where to search the frame of that time.
  void next(const FrameStamp& stamp, SearchOrder& order);
  /// Takes what the order's search found. False: it was not enough; the order now is to search the frame whole, and
  /// that result is to be taken, too, before that of any later frame.
  bool take(SearchOrder& order, const FrameResult& result);
  /// What the last frame taken came to.
  const TrackedFrame& frame() const;
  const TrackerCounts& counts() const;

  /// Where a pose filter expects a marker at the next frame's time, in place of its corners' constant velocity; for a
  /// marker that is not held, nothing happens. `pose`: PoseFilter::foretell of that time, of a marker of `size_m`.
  void expect(const MarkerFamily& family, int id, const CameraModel& camera, double size_m, const FilteredPose& pose);
  /// Holds nothing: the next frame is searched whole. What is in flight is forgotten, and not to be taken any more.
  void reset();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  SearchOrder order_;  // look's
};

}  // namespace berth
