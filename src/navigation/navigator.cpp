#include "berth/navigator.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "berth/error.hpp"
#include "divide_up.hpp"
#include "navigation/candidates.hpp"
#include "navigation/navigator_plans.hpp"
#include "navigation/network_output.hpp"
#include "navigation/network_watch.hpp"
#include "navigation/track.hpp"

namespace berth {
namespace {

constexpr int kMinSide = 64;
constexpr int kMaxSide = 16384;

/// The size of the target in a window that is laid around it, px.
constexpr int kWindowDiameter = 96;

/// Further windows around a place that one window is not sure of are so many of their px off it, right down and left
/// up.
constexpr int kAside = 16;
/// The log-odds of a window that sees the target elsewhere or of another size, at most.
constexpr int kMisfit_q8 = -512;
/// A believed target is remembered where it was for so many frames.
constexpr int kMemoryFrames = 5;
/// After so many of them something sure elsewhere takes its place.
constexpr int kDoubtFrames = 2;

/// Log-odds in 1/256.
int q8(double log_odds) { return static_cast<int>(log_odds * 256); }

}  // namespace

struct Navigator::Impl : NavigatorPlans {
  Impl(Backend& backend_, int width_, int height_, const NavigatorConfig& config_)
      : NavigatorPlans(backend_, read_network(config_.network), width_, height_),
        config(config_),
        candidates(static_cast<std::size_t>(search.grid_width() * search.grid_height())),
        track({q8(config_.doubt), q8(config_.most_evidence), q8(config_.evidence), kMemoryFrames}) {
    readings.reserve(kCloseLooks + 1);
    if (config.health) watch = std::make_unique<NetworkWatch>(*config.health, *this);
  }

  /// The window of the network's side around a place of the frame: the target `diameter` px wide in it, its middle
  /// (right, down) window px from the window's.
  std::array<s32, 4> window_at(const Place& place, int diameter, int right, int down) const {
    const s32 wide = static_cast<s32>(std::clamp<std::int64_t>(place.d_q16 / 256 / diameter, kMinStep, kMaxStep));
    const std::int64_t half = static_cast<std::int64_t>(network.side) * wide / 2;
    // On whole pixels of the frame: nothing is resampled where the scale is 1.
    const auto corner = [&](std::int64_t at_q16, int off) {
      return static_cast<s32>((at_q16 / 256 + 128 - half - off * wide) >> 8) * 256;
    };
    return {corner(place.x_q16, right), corner(place.y_q16, down), wide, 0};
  }
  std::array<s32, 4> window_at(const Place& place) const { return window_at(place, kWindowDiameter, 0, 0); }

  Reading reading(std::size_t k, const std::array<s32, 4>& window) const {
    const NetworkOutput output =
        network_output(network, close_sums.data() + k * static_cast<std::size_t>(close.sums_each()));
    return {output.logit_q8, place_in_frame(output, window.data(), 0, 0)};
  }

  /// What a frame shows, as far as is known.
  void take(const Reading& reading, const std::array<s32, 4>& window) {
    sighting.score_q15 = score_of(network, reading.logit_q8);
    sighting.x_q16 = reading.place.x_q16;
    sighting.y_q16 = reading.place.y_q16;
    sighting.d_q16 = reading.place.d_q16;
    sighting.window = {window[0], window[1], window[2]};
  }

  /// Runs kCloseLooks windows at once.
  bool look_closely(const std::array<std::array<s32, 4>, kCloseLooks>& windows) {
    stream->upload(close.windows(), windows.data(), sizeof windows);
    return run(close, close_sums);
  }

  /// Looks where the target was. One window says so if it is sure; else it and others around it together.
  bool follow_track(bool& seen) {
    const Place last = track.expected();
    const std::array<s32, 4> window = window_at(last);
    stream->upload(follow.windows(), window.data(), sizeof window);
    if (!run(follow, close_sums)) return false;
    readings.assign(1, reading(0, window));
    Reading all = readings[0];
    seen = track.fits(all.place) && score_of(network, all.logit_q8) >= config.first_threshold_q15;
    if (!seen) {
      const std::array<std::array<s32, 4>, kCloseLooks> others = {window_at(last, kWindowDiameter, kAside, kAside),
                                                                  window_at(last, kWindowDiameter, -kAside, -kAside),
                                                                  window_at(last, kWindowDiameter * 4 / 5, 0, 0)};
      if (!look_closely(others)) return false;
      for (std::size_t k = 0; k < kCloseLooks; ++k) readings.push_back(reading(k, others[k]));
      const int least = track.believed() ? config.keep_threshold_q15 : config.threshold_q15;
      seen = agreed(track, readings, kMisfit_q8, all) && score_of(network, all.logit_q8) >= least;
    }
    if (seen) {
      track.see(all);
      seen = sighting.tracked = track.alive();
      take(all, window);
    } else {
      sighting.score_q15 = score_of(network, readings[0].logit_q8);
    }
    return true;
  }

  /// Looks over the whole frame. Where a target was just lost, one near it is the same; elsewhere what is sure begins
  /// anew, once nothing else is believed.
  bool search_frame(bool& seen) {
    if (!run(search, search_sums)) return false;
    const std::size_t found = find_candidates(network, search, whole.data(), spacing, search_sums.data(),
                                              config.search_threshold_q15, candidates);
    sighting.candidates = static_cast<int>(found);
    if (found == 0) return true;
    std::array<std::array<s32, 4>, kCloseLooks> windows;
    for (std::size_t k = 0; k < kCloseLooks; ++k) windows[k] = window_at(candidates[std::min(k, found - 1)].place);
    if (!look_closely(windows)) return false;
    std::size_t best = kCloseLooks;
    bool near = false;
    Reading chosen;
    for (std::size_t k = 0; k < std::min<std::size_t>(found, kCloseLooks); ++k) {
      const Reading one = reading(k, windows[k]);
      const int its_score = score_of(network, one.logit_q8);
      const bool fits = track.believed() && its_score >= config.threshold_q15 &&
                        track.fits(one.place, its_score >= config.first_threshold_q15);
      if (best < kCloseLooks && (near != fits ? near : one.logit_q8 <= chosen.logit_q8)) continue;
      best = k;
      near = fits;
      chosen = one;
    }
    const int score = score_of(network, chosen.logit_q8);
    if (near) {
      track.see(chosen);
      seen = sighting.tracked = true;
    } else if ((!track.believed() || track.missed() >= kDoubtFrames) && score >= config.first_threshold_q15) {
      track.begin(chosen);
      seen = track.alive();
    }
    take(chosen, windows[best]);
    return true;
  }

  void measure() {
    sighting.has_range = false;
    if (!config.camera || sighting.status != FrameStatus::ok) return;
    const auto ray = config.camera->undistort(static_cast<double>(sighting.x_q16) / 65536,
                                              static_cast<double>(sighting.y_q16) / 65536);
    const double length = std::sqrt(ray[0] * ray[0] + ray[1] * ray[1] + 1);
    // d = f D / depth, f the mean of both directions'.
    const double focal = (config.camera->fx + config.camera->fy) / 2;
    const double depth = focal * config.target_diameter_m * 65536 / static_cast<double>(sighting.d_q16);
    sighting.bearing = {ray[0] / length, ray[1] / length, 1 / length};
    sighting.range_m = depth * length;
    sighting.range_deviation_m = sighting.range_m * config.range_deviation;
    sighting.has_range = true;
  }

  NavigatorConfig config;
  std::vector<Candidate> candidates;
  std::vector<Reading> readings;
  Track track;
  Sighting sighting;
  std::unique_ptr<NetworkWatch> watch;  // where there is a HealthConfig
};

Navigator::Navigator(Backend& backend, int width, int height, const NavigatorConfig& config) {
  if (width < kMinSide || height < kMinSide || width > kMaxSide || height > kMaxSide) {
    throw Error("image size " + std::to_string(width) + "x" + std::to_string(height) +
                " is outside 64x64 to 16384x16384");
  }
  if (!(config.target_diameter_m > 0)) {
    throw Error("target_diameter_m is " + std::to_string(config.target_diameter_m) + "; give metres above 0");
  }
  // An order that no NaN is in; the sums stay within 32 bits.
  if (!(config.evidence >= 0 && config.evidence <= 1000) || !(config.doubt >= -8 && config.doubt <= 8) ||
      !(config.most_evidence > 0 && config.most_evidence <= 16)) {
    throw Error("evidence is " + std::to_string(config.evidence) + ", doubt " + std::to_string(config.doubt) +
                " and most_evidence " + std::to_string(config.most_evidence) +
                "; give 0 to 1000, -8 to 8, and above 0 to 16");
  }
  impl_ = std::make_unique<Impl>(backend, width, height, config);
  if (impl_->network.heads.geometry == 0) {
    throw Error(config.network + ": a network without geometry cannot say where the target is; train one with it");
  }
}
Navigator::~Navigator() = default;
Navigator::Navigator(Navigator&&) noexcept = default;
Navigator& Navigator::operator=(Navigator&&) noexcept = default;

const Sighting& Navigator::look(View2D<const u8> image, const FrameStamp& stamp) {
  Impl& it = *impl_;
  Sighting& sighting = it.sighting;
  if (image.width != it.width || image.height != it.height) {
    throw Error("an image of " + std::to_string(image.width) + "x" + std::to_string(image.height) +
                " for a navigator of " + std::to_string(it.width) + "x" + std::to_string(it.height));
  }
  sighting.stamp = stamp;
  if (it.watch && !it.watch->is_believed(it)) {
    sighting.status = FrameStatus::device_lost;
    sighting.tracked = sighting.doubted = sighting.has_range = false;
    return sighting;
  }
  for (int y = 0; y < it.height; ++y) {
    std::memcpy(it.padded.data() + static_cast<std::ptrdiff_t>(y) * it.padded_width, image.row(y),
                static_cast<std::size_t>(it.width));
  }
  it.stream->upload(*it.frame, it.padded.data(), it.padded.size());
  sighting.candidates = 0;
  sighting.score_q15 = 0;
  sighting.tracked = false;
  bool alive = true;
  bool seen = false;
  if (it.track.alive()) alive = it.follow_track(seen);
  if (alive && !seen) {
    if (!it.track.believed()) it.track.give_up();
    alive = it.search_frame(seen);
    if (!seen && it.track.alive()) it.track.miss();
  }
  sighting.doubted = seen && !it.track.believed();
  sighting.status = !alive                        ? FrameStatus::device_lost
                    : seen && it.track.believed() ? FrameStatus::ok
                                                  : FrameStatus::no_target;
  it.measure();
  return sighting;
}

HealthReport Navigator::health() const { return impl_->watch ? impl_->watch->report() : HealthReport(); }

void Navigator::forget() { impl_->track.give_up(); }

void Navigator::expect(double x_px, double y_px, double d_px) {
  // What lies far outside is no place to look at, and must not overflow.
  const auto q16 = [](double px) {
    return static_cast<std::int64_t>(std::clamp(px, -2.0 * kMaxSide, 2.0 * kMaxSide) * 65536);
  };
  impl_->track.believe({q16(x_px), q16(y_px), q16(std::max(1.0, d_px))});
}

std::size_t Navigator::device_bytes() const {
  const Impl& it = *impl_;
  return it.device.device_bytes() + it.search.device_bytes() + it.close.device_bytes() + it.follow.device_bytes() +
         it.frame->bytes();
}

}  // namespace berth
