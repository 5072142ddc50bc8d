#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <memory>

#include "berth/frame.hpp"
#include "berth/marker.hpp"
#include "berth/stations.hpp"

namespace berth {

/// Whose camera: StationPair::robot, StationPair::dock.
enum class StationSide : std::size_t { robot, dock };
constexpr std::size_t kStationSides = 2;
const char* name_of(StationSide side);

struct StationPairingConfig {
  /// Mid-exposures further apart are not of one moment, ns. Below half of the shorter period of the two, the frame
  /// that is paired is the nearest one.
  std::int64_t largest_difference_ns = 1'000'000;
  /// Frames of each station that may wait for the other's.
  std::size_t capacity = 64;
};

/// One station's frame, as far as the other needs it.
struct StationFrame {
  /// Its clock's name is the pairing's, and valid as long as that.
  FrameStamp stamp;
  /// Whether the marker was read, and what was read of it.
  bool sees = false;
  Detection marker;
};

/// Frames of one moment: two, or one whose partner did not come.
struct StationMoment {
  /// Mid-exposure; of two, the middle between theirs.
  std::int64_t time_ns = 0;
  /// Both by StationSide.
  std::array<bool, kStationSides> came = {};
  std::array<StationFrame, kStationSides> frames;
  /// Of two: the dock's mid-exposure less the robot's.
  std::int64_t difference_ns = 0;
};

/// What became of one station's frames; they add up to those that were pushed and not refused by an Error.
struct StationCounts {
  u64 paired = 0;
  u64 alone = 0;
  /// Not later than the station's frame before, and kept out.
  u64 out_of_order = 0;
  /// Made room for a newer one, as `capacity` waited already.
  u64 dropped = 0;
  u64 waiting = 0;
};

/// Pairs the frames of two stations by the middle of their exposures. The earlier of the two oldest frames is paired
/// with the other when they are no further apart than `largest_difference_ns`, else it goes alone. A frame goes as
/// soon as it is certain which: when the other station has a frame at or after it, or has ended, or may no longer be
/// waited for (release). So without release and without drops the moments depend on the frames alone, in whatever order
/// the two stations' come in. Takes all its memory when it is made. Not for two threads at once.
class StationPairing {
 public:
  /// Throws Error on a negative difference or no capacity.
  explicit StationPairing(const StationPairingConfig& config);
  ~StationPairing();
  StationPairing(StationPairing&&) noexcept;
  StationPairing& operator=(StationPairing&&) noexcept;

  /// A station's frame, whose times must rise; `marker`: what it reads, or null. `now_ns`: the caller's own time, for
  /// `release`. Where it is full the oldest waiting frame is dropped. The first frame's clock is that of both stations:
  /// throws Error on a frame of another clock, and on clocks that are not one for two cameras: none, or a camera's own.
  void push(StationSide side, const FrameStamp& stamp, const Detection* marker, std::int64_t now_ns = 0);
  /// Whether the next push drops a frame.
  bool is_full(StationSide side) const;
  /// No more frames come from there: the other's need not wait.
  void end(StationSide side);
  /// Frames that were pushed before `now_ns` wait no longer.
  void release(std::int64_t now_ns);
  /// The next moment, in the order of time, if one is certain. After a release a late frame may be older than the
  /// moment before.
  bool next(StationMoment& moment);
  /// So far.
  StationCounts counts(StationSide side) const;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// Where the robot was at a moment, and which station said so.
struct FusedPose {
  std::int64_t time_ns = 0;
  /// A station is blind where no frame of it came, or no marker was read in it, or what was read makes no pose.
  std::array<bool, kStationSides> used = {};
  bool has_pose = false;
  RelativePose robot;
  /// Of both: they do not fit together (RelativePose::disagreement above the gate, or no pose at all fits both).
  bool disagree = false;
};

/// By relative_pose. `gate`: chi-square of 6 degrees of freedom, by default what one frame of 10,000 exceeds.
FusedPose fuse(const StationPair& stations, const StationMoment& moment, double gate = 28);

}  // namespace berth
