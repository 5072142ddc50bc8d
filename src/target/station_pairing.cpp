#include "berth/station_pairing.hpp"

#include <cassert>
#include <string>
#include <string_view>
#include <vector>

#include "berth/error.hpp"

namespace berth {
namespace {

constexpr std::size_t index_of(StationSide side) { return static_cast<std::size_t>(side); }
constexpr std::size_t other_than(std::size_t side) { return 1 - side; }

struct Waiting {
  StationFrame frame;
  std::int64_t since_ns = 0;
};

// One station's frames that wait, oldest first, in a ring that never grows.
struct Queue {
  std::vector<Waiting> ring;
  std::size_t first = 0, count = 0;
  bool ended = false, has_last = false;
  std::int64_t last_ns = 0;  // of the frame that came last
  StationCounts counts;

  bool is_full() const { return count == ring.size(); }
  Waiting& oldest() { return ring[first]; }
  std::int64_t oldest_ns() const { return ring[first].frame.stamp.mid_exposure_ns; }
  void pop() {
    first = (first + 1) % ring.size();
    --count;
  }
};

void check_clock(StationSide side, const char* clock, const std::string& so_far) {
  const std::string_view name = clock;
  const auto who = [&] { return std::string("station ") + name_of(side) + ": "; };
  if (name == "none") {
    throw Error(who() +
                "its frames have no times, so they cannot be paired; use a video, a recording or a live source");
  }
  if (name == "camera") {
    throw Error(who() +
                "its frames' times are on the camera's own clock, which is no other camera's; have the camera take the "
                "host's time (time=host) or one by PTP (time=ptp)");
  }
  if (!so_far.empty() && so_far != name) {
    throw Error(who() + "its frames' times are on the clock '" + clock + "', the other station's on '" + so_far +
                "'; give both stations sources of one clock, e.g. time=ptp or time=host for both");
  }
}

}  // namespace

const char* name_of(StationSide side) { return side == StationSide::robot ? "robot" : "dock"; }

struct StationPairing::Impl {
  std::int64_t largest_difference_ns = 0;
  bool has_released = false;
  std::int64_t released_ns = 0;
  std::string clock;
  std::array<Queue, kStationSides> queues;

  // Whether the oldest of one station need not wait for one of the other, which has none.
  bool goes_alone(std::size_t side) {
    const Queue& other = queues[other_than(side)];
    const Waiting& waiting = queues[side].oldest();
    if (other.ended || (has_released && waiting.since_ns < released_ns)) return true;
    // The other's next one is later than its last.
    return other.has_last && other.last_ns - waiting.frame.stamp.mid_exposure_ns >= largest_difference_ns;
  }

  void take(std::size_t side, StationMoment& moment) {
    Queue& queue = queues[side];
    moment.came[side] = true;
    moment.frames[side] = queue.oldest().frame;
    queue.pop();
  }

  void take_alone(std::size_t side, StationMoment& moment) {
    moment.time_ns = queues[side].oldest_ns();
    moment.difference_ns = 0;
    take(side, moment);
    ++queues[side].counts.alone;
  }
};

StationPairing::StationPairing(const StationPairingConfig& config) : impl_(std::make_unique<Impl>()) {
  if (config.largest_difference_ns < 0) {
    throw Error("station pairing: field 'largest_difference_ns' is " + std::to_string(config.largest_difference_ns) +
                "; give 0 or more");
  }
  if (config.capacity == 0) throw Error("station pairing: field 'capacity' is 0; give 1 or more");
  impl_->largest_difference_ns = config.largest_difference_ns;
  impl_->clock.reserve(64);
  for (Queue& queue : impl_->queues) queue.ring.resize(config.capacity);
}

StationPairing::~StationPairing() = default;
StationPairing::StationPairing(StationPairing&&) noexcept = default;
StationPairing& StationPairing::operator=(StationPairing&&) noexcept = default;

void StationPairing::push(StationSide side, const FrameStamp& stamp, const Detection* marker, std::int64_t now_ns) {
  check_clock(side, stamp.clock, impl_->clock);
  if (impl_->clock.empty()) impl_->clock = stamp.clock;
  Queue& queue = impl_->queues[index_of(side)];
  assert(!queue.ended);
  if (queue.has_last && stamp.mid_exposure_ns <= queue.last_ns) {
    ++queue.counts.out_of_order;
    return;
  }
  queue.has_last = true;
  queue.last_ns = stamp.mid_exposure_ns;
  if (queue.is_full()) {
    queue.pop();
    ++queue.counts.dropped;
  }
  Waiting& place = queue.ring[(queue.first + queue.count++) % queue.ring.size()];
  place.since_ns = now_ns;
  place.frame.stamp = stamp;
  place.frame.stamp.clock = impl_->clock.c_str();  // the source's own may end with it
  place.frame.sees = marker != nullptr;
  if (marker != nullptr) place.frame.marker = *marker;
}

bool StationPairing::is_full(StationSide side) const { return impl_->queues[index_of(side)].is_full(); }

void StationPairing::end(StationSide side) { impl_->queues[index_of(side)].ended = true; }

void StationPairing::release(std::int64_t now_ns) {
  impl_->has_released = true;
  impl_->released_ns = now_ns;
}

bool StationPairing::next(StationMoment& moment) {
  auto& [robot, dock] = impl_->queues;
  moment.came = {};
  if (robot.count > 0 && dock.count > 0) {
    const std::int64_t difference = dock.oldest_ns() - robot.oldest_ns();
    if (difference > impl_->largest_difference_ns) {
      impl_->take_alone(index_of(StationSide::robot), moment);
    } else if (difference < -impl_->largest_difference_ns) {
      impl_->take_alone(index_of(StationSide::dock), moment);
    } else {
      moment.time_ns = robot.oldest_ns() + difference / 2;
      moment.difference_ns = difference;
      for (std::size_t side = 0; side < kStationSides; ++side) {
        impl_->take(side, moment);
        ++impl_->queues[side].counts.paired;
      }
    }
    return true;
  }
  for (std::size_t side = 0; side < kStationSides; ++side) {
    if (impl_->queues[side].count == 0 || !impl_->goes_alone(side)) continue;
    impl_->take_alone(side, moment);
    return true;
  }
  return false;
}

StationCounts StationPairing::counts(StationSide side) const {
  const Queue& queue = impl_->queues[index_of(side)];
  StationCounts counts = queue.counts;
  counts.waiting = queue.count;
  return counts;
}

FusedPose fuse(const StationPair& stations, const StationMoment& moment, double gate) {
  FusedPose fused;
  fused.time_ns = moment.time_ns;
  const auto seen_by = [&](StationSide side) -> const Detection* {
    const StationFrame& frame = moment.frames[index_of(side)];
    return moment.came[index_of(side)] && frame.sees ? &frame.marker : nullptr;
  };
  const std::array<const Detection*, kStationSides> seen = {seen_by(StationSide::robot), seen_by(StationSide::dock)};
  fused.has_pose = relative_pose(stations, seen[0], seen[1], fused.robot);
  if (fused.has_pose && fused.robot.views == 2) {
    fused.used = {true, true};
    fused.disagree = fused.robot.disagreement > gate;
    return fused;
  }
  // Of what is left: which of the two can do alone.
  RelativePose alone;
  const std::array<bool, kStationSides> able = {seen[0] != nullptr && relative_pose(stations, seen[0], nullptr, alone),
                                                seen[1] != nullptr && relative_pose(stations, nullptr, seen[1], alone)};
  if (fused.has_pose) {
    fused.used = able;
  } else {
    // Each makes a pose, and both together none.
    fused.disagree = able[0] && able[1];
  }
  return fused;
}

}  // namespace berth
