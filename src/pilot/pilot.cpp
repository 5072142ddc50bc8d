#include "berth/pilot.hpp"

#include <cmath>

#include "pilot/judgement.hpp"

namespace berth {
namespace {

/// So much further than where docking begins every frame is searched for the marker.
constexpr double kNear = 1.5;

}  // namespace

struct Pilot::Impl {
  Impl(Backend& docking, Backend& navigation, int width, int height, const PilotConfig& wanted)
      : config(checked(wanted)),
        detector(docking, width, height, config.detector),
        navigator(navigation, width, height, config.navigator),
        judgement(config, 0) {}

  /// Far away the network finds the way; a look for the marker now and then is enough.
  bool wants_marker() const {
    const PilotFrame& last = judgement.frame();
    if (judgement.mode() == Mode::docking || last.marker != nullptr) return true;
    if (last.has_position && is_near(last.position_m)) return true;
    return frames % config.marker_every == 0;
  }
  bool is_near(const std::array<double, 3>& p) const {
    return std::sqrt(p[0] * p[0] + p[1] * p[1] + p[2] * p[2]) < kNear * config.hand_over.docking_m;
  }

  PilotConfig config;
  Detector detector;
  Navigator navigator;
  Judgement judgement;
  int frames = 0;
};

Pilot::Pilot(Backend& docking, Backend& navigation, int width, int height, const PilotConfig& config)
    : impl_(std::make_unique<Impl>(docking, navigation, width, height, config)) {}
Pilot::~Pilot() = default;
Pilot::Pilot(Pilot&&) noexcept = default;
Pilot& Pilot::operator=(Pilot&&) noexcept = default;

const PilotFrame& Pilot::look(View2D<const u8> image, const FrameStamp& stamp) {
  Impl& it = *impl_;
  const bool for_marker = it.wants_marker();
  it.judgement.begin(stamp);
  if (for_marker) it.judgement.add(it.detector.detect(image, stamp));
  // In docking mode the network helps out where the marker is not read.
  if (it.judgement.mode() != Mode::docking || !it.judgement.has_marker()) {
    if (const auto at = it.judgement.take_expectation()) it.navigator.expect(at->x_px, at->y_px, at->d_px);
    it.judgement.add(it.navigator.look(image, stamp));
  }
  const PilotFrame& frame = it.judgement.conclude();
  ++it.frames;
  return frame;
}

}  // namespace berth
