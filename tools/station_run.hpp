#pragma once

#include <array>
#include <condition_variable>
#include <cstdint>
#include <memory>
#include <mutex>
#include <string>

#include "berth/station_pairing.hpp"
#include "frame_observer.hpp"
#include "moment_observer.hpp"

namespace berth::cli {

/// The marker that a station's camera looks at, where both are mounted, and whether frames come at a pace of their own,
/// so that they cannot wait.
struct StationTarget {
  std::string family;
  int id = 0;
  Pose camera, marker;
  bool is_live = false;
};

/// Where two streams, each on a thread of its own, hand over what they read, and one thread takes the moments that
/// their frames make.
class StationRun {
 public:
  /// `wait_ns`: for how long a camera's frame waits for the other station's; recordings wait until it is there.
  StationRun(const StationPairingConfig& config, std::int64_t wait_ns);

  /// For one station's stream. What is wrong with its options or its frames is an Error there.
  std::shared_ptr<FrameObserver> observer(StationSide side, const StationTarget& target);
  /// A station's stream is over, or never began.
  void leave(StationSide side);
  /// The next moment, when it is certain; false when both stations have left. Until then it is taken again and again,
  /// or streams of recordings wait.
  bool next(StationMoment& moment);
  /// Nobody takes moments any more: streams need not wait.
  void stop();

  /// These three are complete when the first moment has come. Whether frames of a station come at a pace of their own.
  bool is_live() const { return is_live_; }
  const StationPair& stations() const { return stations_; }
  BothCounts counts();

 private:
  class Observer;
  void begin(StationSide side, const StationTarget& target, const ObservedStream& stream);
  void push(StationSide side, const FrameStamp& stamp, const Detection* marker, bool is_live);

  const std::int64_t wait_ns_;
  std::mutex mutex_;
  /// Of a frame or an end, for `next`; of a start or of room, for the streams.
  std::condition_variable news_, room_;
  StationPairing pairing_;
  StationPair stations_;
  std::array<bool, kStationSides> has_begun_ = {}, has_left_ = {};
  bool is_live_ = false, is_stopped_ = false;
};

}  // namespace berth::cli
