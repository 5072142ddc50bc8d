#include "berth/navigator.hpp"

#include <algorithm>
#include <cmath>
#include <cstring>

#include "berth/error.hpp"
#include "divide_up.hpp"
#include "navigation/candidates.hpp"
#include "navigation/network_output.hpp"
#include "navigation/network_plan.hpp"

namespace berth {
namespace {

constexpr int kMinSide = 64;
constexpr int kMaxSide = 16384;

/// The search sees the frame this high, px: what is smaller than 40 px there is not what the network was trained on.
constexpr int kSearchHeight = 480;
/// The target's middle may be this far from a window's for the network to know it, search px.
constexpr int kReach = 32;
/// Places looked at closely in one frame.
constexpr int kCloseLooks = 3;
/// The size of the target in a window that is laid around it, px.
constexpr int kWindowDiameter = 96;

constexpr int kMinStep = 256;
constexpr int kMaxStep = 2560;

int search_step(int height) { return std::clamp(height * 256 / kSearchHeight, kMinStep, kMaxStep); }

/// Length of the search's window: grid positions from kReach before the frame's first pixel to kReach after its last.
int search_length(int frame, int step, int side, int spacing) {
  const int seen = (frame * 256 + step - 1) / step;
  return side + std::max(0, round_up(seen - 2 * kReach, spacing));
}

}  // namespace

struct Navigator::Impl {
  Impl(Backend& backend_, int width_, int height_, const NavigatorConfig& config_)
      : backend(backend_),
        width(width_),
        height(height_),
        config(config_),
        network(read_network(config_.network)),
        device(backend_, network),
        padded_width(round_up(width_, 4)),
        padded(static_cast<std::size_t>(padded_width) * static_cast<std::size_t>(height_)),
        frame(backend_.make_buffer(padded.size())),
        step(search_step(height_)),
        spacing(position_spacing(network)),
        search(device, view(), 1, search_length(width_, step, network.side, spacing),
               search_length(height_, step, network.side, spacing)),
        close(device, view(), kCloseLooks, network.side, network.side),
        follow(device, view(), 1, network.side, network.side),
        stream(backend_.make_stream()),
        whole{search_corner(width_, search.width()), search_corner(height_, search.height()), step, 0},
        search_sums(search.sums().bytes() / 4),
        close_sums(close.sums().bytes() / 4),
        candidates(static_cast<std::size_t>(search.grid_width() * search.grid_height())) {
    upload_at_start(backend_, *stream, search.windows(), whole.data(), sizeof whole);
  }

  FrameView view() const { return {frame.get(), width, height, padded_width}; }

  bool run(NetworkPlan& plan, std::vector<s32>& sums) {
    stream->replay(plan.plan());
    stream->download(plan.sums(), sums.data(), plan.sums().bytes());
    return stream->finish();
  }

  /// The window of the network's side around a place of the frame.
  std::array<s32, 4> window_at(std::int64_t x_q16, std::int64_t y_q16, std::int64_t d_q16) const {
    const s32 wide = static_cast<s32>(std::clamp<std::int64_t>(d_q16 / 256 / kWindowDiameter, kMinStep, kMaxStep));
    const std::int64_t half = static_cast<std::int64_t>(network.side) * wide / 2;
    // On whole pixels of the frame: nothing is resampled where the scale is 1.
    const auto corner = [half](std::int64_t at_q16) {
      return static_cast<s32>((at_q16 / 256 + 128 - half) >> 8) * 256;
    };
    return {corner(x_q16), corner(y_q16), wide, 0};
  }

  void take(const NetworkOutput& output, const std::array<s32, 4>& window) {
    if (output.score_q15 <= sighting.score_q15) return;
    sighting.score_q15 = output.score_q15;
    const Place place = place_in_frame(output, window.data(), 0, 0);
    sighting.x_q16 = place.x_q16;
    sighting.y_q16 = place.y_q16;
    sighting.d_q16 = place.d_q16;
    sighting.window = {window[0], window[1], window[2]};
  }

  bool follow_last() {
    const std::array<s32, 4> window = window_at(sighting.x_q16, sighting.y_q16, sighting.d_q16);
    sighting.score_q15 = 0;
    stream->upload(follow.windows(), window.data(), sizeof window);
    if (!run(follow, close_sums)) return false;
    take(network_output(network, close_sums.data()), window);
    return true;
  }

  bool search_frame() {
    sighting.score_q15 = 0;
    if (!run(search, search_sums)) return false;
    const std::size_t found = find_candidates(network, search, whole.data(), spacing, search_sums.data(),
                                              config.search_threshold_q15, candidates);
    sighting.candidates = static_cast<int>(found);
    if (found == 0) return true;
    std::array<s32, 4 * kCloseLooks> windows{};
    for (std::size_t k = 0; k < kCloseLooks; ++k) {
      const Place& place = candidates[std::min(k, found - 1)].place;
      const std::array<s32, 4> window = window_at(place.x_q16, place.y_q16, place.d_q16);
      std::copy(window.begin(), window.end(), windows.begin() + static_cast<long>(k) * 4);
    }
    stream->upload(close.windows(), windows.data(), sizeof windows);
    if (!run(close, close_sums)) return false;
    const std::size_t each = static_cast<std::size_t>(close.sums_each());
    for (std::size_t k = 0; k < std::min<std::size_t>(found, kCloseLooks); ++k) {
      const s32* w = windows.data() + k * 4;
      take(network_output(network, close_sums.data() + k * each), {w[0], w[1], w[2], 0});
    }
    return true;
  }

  /// Of a window of `length` search px in the middle of the frame.
  s32 search_corner(int frame_length, int length) const { return (frame_length * 256 - length * step) / 2; }

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

  Backend& backend;
  int width;
  int height;
  NavigatorConfig config;
  Network network;
  DeviceNetwork device;
  int padded_width;
  std::vector<u8> padded;
  std::unique_ptr<Buffer> frame;
  int step;
  int spacing;
  NetworkPlan search;
  NetworkPlan close;
  NetworkPlan follow;
  std::unique_ptr<Stream> stream;
  std::array<s32, 4> whole;  // the search's window
  std::vector<s32> search_sums;
  std::vector<s32> close_sums;
  std::vector<Candidate> candidates;
  Sighting sighting;
};

Navigator::Navigator(Backend& backend, int width, int height, const NavigatorConfig& config) {
  if (width < kMinSide || height < kMinSide || width > kMaxSide || height > kMaxSide) {
    throw Error("image size " + std::to_string(width) + "x" + std::to_string(height) +
                " is outside 64x64 to 16384x16384");
  }
  if (!(config.target_diameter_m > 0)) {
    throw Error("target_diameter_m is " + std::to_string(config.target_diameter_m) + "; give metres above 0");
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
  for (int y = 0; y < it.height; ++y) {
    std::memcpy(it.padded.data() + static_cast<std::ptrdiff_t>(y) * it.padded_width, image.row(y),
                static_cast<std::size_t>(it.width));
  }
  it.stream->upload(*it.frame, it.padded.data(), it.padded.size());
  sighting.candidates = 0;
  const bool had_it = sighting.status == FrameStatus::ok;
  bool alive = !had_it || it.follow_last();
  sighting.tracked = had_it && alive && sighting.score_q15 >= it.config.threshold_q15;
  if (alive && !sighting.tracked) alive = it.search_frame();
  const int least = sighting.tracked ? it.config.threshold_q15 : it.config.first_threshold_q15;
  sighting.status = !alive                        ? FrameStatus::device_lost
                    : sighting.score_q15 >= least ? FrameStatus::ok
                                                  : FrameStatus::no_target;
  it.measure();
  return sighting;
}

void Navigator::forget() { impl_->sighting.status = FrameStatus::no_target; }

void Navigator::expect(double x_px, double y_px, double d_px) {
  Sighting& sighting = impl_->sighting;
  // What lies far outside is no place to look at, and must not overflow.
  const auto q16 = [](double px) {
    return static_cast<std::int64_t>(std::clamp(px, -2.0 * kMaxSide, 2.0 * kMaxSide) * 65536);
  };
  sighting.x_q16 = q16(x_px);
  sighting.y_q16 = q16(y_px);
  sighting.d_q16 = q16(std::max(1.0, d_px));
  sighting.status = FrameStatus::ok;
}

std::size_t Navigator::device_bytes() const {
  const Impl& it = *impl_;
  return it.device.device_bytes() + it.search.device_bytes() + it.close.device_bytes() + it.follow.device_bytes() +
         it.frame->bytes();
}

}  // namespace berth
