#include "station_run.hpp"

#include <algorithm>
#include <chrono>
#include <utility>

#include "berth/error.hpp"
#include "monotonic.hpp"

namespace berth::cli {
namespace {

constexpr std::size_t index_of(StationSide side) { return static_cast<std::size_t>(side); }
constexpr StationSide other_than(StationSide side) {
  return side == StationSide::robot ? StationSide::dock : StationSide::robot;
}

}  // namespace

class StationRun::Observer final : public FrameObserver {
 public:
  Observer(StationRun& run, StationSide side, StationTarget target)
      : run_(run), side_(side), target_(std::move(target)) {}

  void begin(const ObservedStream& stream) override {
    width_ = stream.width;
    height_ = stream.height;
    run_.begin(side_, target_, stream);
  }

  void observe(const ObservedFrame& frame) override {
    if (frame.image.width != width_ || frame.image.height != height_) {
      throw Error(frame.label + ": it is of another size than the station's first frame; give frames of one camera");
    }
    const std::vector<Detection>& all = frame.result.detections;
    const auto marker = std::find_if(all.begin(), all.end(), [&](const Detection& detection) {
      return detection.id == target_.id && detection.family->name == target_.family;
    });
    run_.push(side_, frame.result.stamp, marker == all.end() ? nullptr : &*marker, target_.is_live);
  }

 private:
  StationRun& run_;
  const StationSide side_;
  const StationTarget target_;
  int width_ = 0, height_ = 0;
};

StationRun::StationRun(const StationPairingConfig& config, std::int64_t wait_ns)
    : wait_ns_(wait_ns), pairing_(config) {}

std::shared_ptr<FrameObserver> StationRun::observer(StationSide side, const StationTarget& target) {
  return std::make_shared<Observer>(*this, side, target);
}

void StationRun::begin(StationSide side, const StationTarget& target, const ObservedStream& stream) {
  const std::string who = std::string("station ") + name_of(side) + ": ";
  if (!stream.config.camera) throw Error(who + "key 'camera' is missing; give the file of its calibration");
  const double size_m = marker_size_m(stream.config, family(target.family), target.id);
  if (!(size_m > 0)) throw Error(who + "key 'size' is missing; give the marker's side in metres, e.g. size = 0.08");
  std::unique_lock lock(mutex_);
  Station& station = side == StationSide::robot ? stations_.robot : stations_.dock;
  station.lens = *stream.config.camera;
  station.camera = target.camera;
  station.marker = target.marker;
  station.marker_size_m = size_m;
  is_live_ = is_live_ || target.is_live;
  has_begun_[index_of(side)] = true;
  room_.notify_all();
  // One that cannot be opened is a mistake of the user's, and no loss.
  const std::size_t other = index_of(other_than(side));
  room_.wait(lock, [&] { return has_begun_[other] || has_left_[other] || is_stopped_; });
  if (!has_begun_[other]) throw Error(who + "ended, as the other station did not begin; mend that one");
}

void StationRun::push(StationSide side, const FrameStamp& stamp, const Detection* marker, bool is_live) {
  std::unique_lock lock(mutex_);
  if (!is_live) room_.wait(lock, [&] { return !pairing_.is_full(side) || is_stopped_; });
  pairing_.push(side, stamp, marker, monotonic_ns());
  news_.notify_one();
}

void StationRun::leave(StationSide side) {
  const std::lock_guard lock(mutex_);
  has_left_[index_of(side)] = true;
  pairing_.end(side);
  news_.notify_one();
  room_.notify_all();
}

bool StationRun::next(StationMoment& moment) {
  std::unique_lock lock(mutex_);
  while (true) {
    if (is_live_) pairing_.release(monotonic_ns() - wait_ns_);
    if (pairing_.next(moment)) {
      room_.notify_all();
      return true;
    }
    if (has_left_[0] && has_left_[1]) return false;
    // What waits for its partner is looked at again, whether or not anything comes.
    news_.wait_for(lock, std::chrono::nanoseconds(std::max<std::int64_t>(wait_ns_ / 4, 1'000'000)));
  }
}

void StationRun::stop() {
  const std::lock_guard lock(mutex_);
  is_stopped_ = true;
  room_.notify_all();
}

BothCounts StationRun::counts() {
  const std::lock_guard lock(mutex_);
  return {pairing_.counts(StationSide::robot), pairing_.counts(StationSide::dock)};
}

}  // namespace berth::cli
