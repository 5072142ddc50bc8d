#include "berth/pilot_stream.hpp"

#include <atomic>
#include <string>
#include <utility>

#include "berth/error.hpp"
#include "monotonic.hpp"
#include "pilot/judgement.hpp"
#include "pilot/network_thread.hpp"

namespace berth {
namespace {

PilotStreamConfig checked(PilotStreamConfig config) {
  config.pilot = checked(std::move(config.pilot));
  config.pipeline.detector = config.pilot.detector;
  if (config.network_frames < 1) {
    throw Error("network_frames is " + std::to_string(config.network_frames) + "; give 1 or more");
  }
  return config;
}

}  // namespace

struct PilotStream::Impl {
  Impl(const std::vector<Backend*>& docking, Backend& navigation, int width, int height,
       const PilotStreamConfig& wanted, Deliver callback)
      : config(checked(wanted)),
        deliver(std::move(callback)),
        network(navigation, width, height, config.pilot.navigator),
        pipeline(docking, width, height, config.pipeline, [this](const PipelineFrame& frame) { take(frame); }) {
    if (!deliver) throw Error("a pilot's stream delivers its frames; give it a callback");
  }

  void start() {
    if (network.is_started()) throw Error("the pilot's stream is running; stop it before it is started again");
    judgement.emplace(config.pilot, config.network_frames);
    frames = 0;
    given_at.reset();
    is_network_lost = false;
    for (auto* counts : {&beside_network, &alone}) {
      counts->frames = 0;
      for (std::atomic<u64>& late : counts->late) late = 0;
    }
    looks = late_looks = lost_looks = 0;
    network.start();
    try {
      pipeline.start();
    } catch (...) {
      network.stop();
      throw;
    }
  }

  /// On the host's thread.
  void take(const PipelineFrame& frame) {
    PilotStreamFrame now;
    now.frame = &frame;
    count_deadlines(frame);
    judgement->begin(frame.result->stamp);
    judgement->add(*frame.result);
    hear_network(now);
    now.pilot = &judgement->conclude();
    const bool wants_network = judgement->mode() != Mode::docking || !judgement->has_marker();
    if (wants_network && !given_at && !is_network_lost) {
      network.give(frame.image, frame.result->stamp, judgement->take_expectation());
      given_at = frames;
      now.is_looked_at = true;
      ++looks;
    }
    ++frames;
    deliver(now);
  }

  /// The network's word, at a frame that it may come at.
  void hear_network(PilotStreamFrame& now) {
    if (!given_at) return;
    const u64 since = frames - *given_at;
    const u64 period = static_cast<u64>(config.network_frames);
    if (since == 0 || since % period != 0) return;
    if (!network.take(sighting, config.pipeline.overrun == Overrun::wait)) return;
    given_at.reset();
    now.late_by = static_cast<int>(since / period) - 1;
    if (now.late_by > 0) ++late_looks;
    if (sighting.status == FrameStatus::device_lost) {
      // The marker's part goes on without it.
      is_network_lost = true;
      ++lost_looks;
      return;
    }
    judgement->add(sighting);
  }

  void count_deadlines(const PipelineFrame& frame) {
    std::int64_t under_way_ns = 0;
    for (const Lap lap : {Lap::wait, Lap::device, Lap::queue, Lap::decode, Lap::corners, Lap::pose}) {
      under_way_ns += frame.laps_ns[static_cast<std::size_t>(lap)];
    }
    Beside& counts = network.was_at_work_since(monotonic_ns() - under_way_ns) ? beside_network : alone;
    ++counts.frames;
    for (std::size_t i = 0; i < counts.late.size(); ++i) {
      if (frame.laps_ns[static_cast<std::size_t>(Lap::latency)] > config.pipeline.deadlines_ns[i]) ++counts.late[i];
    }
  }

  struct Beside {
    std::atomic<u64> frames = 0;
    std::array<std::atomic<u64>, 2> late = {};
    PilotStreamCounts::Beside plain() const { return {frames, {late[0], late[1]}}; }
  };

  const PilotStreamConfig config;
  const Deliver deliver;
  NetworkThread network;
  // The host thread's.
  std::optional<Judgement> judgement;
  Sighting sighting;
  u64 frames = 0;               // delivered
  std::optional<u64> given_at;  // the frame that the network has, of these
  bool is_network_lost = false;
  std::atomic<u64> looks = 0, late_looks = 0, lost_looks = 0;
  Beside beside_network, alone;
  Pipeline pipeline;  // last: its threads end before what they use does
};

PilotStream::PilotStream(const std::vector<Backend*>& docking, Backend& navigation, int width, int height,
                         const PilotStreamConfig& config, Deliver deliver)
    : impl_(std::make_unique<Impl>(docking, navigation, width, height, config, std::move(deliver))) {}
PilotStream::~PilotStream() = default;

void PilotStream::start() { impl_->start(); }
void PilotStream::stop() {
  try {
    impl_->pipeline.stop();
  } catch (...) {
    impl_->network.stop();
    throw;
  }
  impl_->network.stop();
}
void PilotStream::close() { impl_->pipeline.close(); }
bool PilotStream::push(View2D<const u8> image, const FrameStamp& stamp) { return impl_->pipeline.push(image, stamp); }
FrameSlot PilotStream::begin() { return impl_->pipeline.begin(); }
bool PilotStream::commit(const FrameStamp& stamp) { return impl_->pipeline.commit(stamp); }
const Pipeline& PilotStream::pipeline() const { return impl_->pipeline; }

HealthReport PilotStream::network_health() const { return impl_->network.health(); }

PilotStreamCounts PilotStream::counts() const {
  const Impl& it = *impl_;
  return {it.looks, it.late_looks, it.lost_looks, it.beside_network.plain(), it.alone.plain()};
}

}  // namespace berth
