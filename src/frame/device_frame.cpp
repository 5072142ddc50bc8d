#include <algorithm>
#include <functional>
#include <string>

#include "berth/error.hpp"
#include "frame/detector_parts.hpp"
#include "frame/window.hpp"
#include "monotonic.hpp"

namespace berth {
namespace {

std::size_t slots_of(const SearchArea& area) {
  std::size_t slots = 0;
  for (const SearchResult& search : area.searches) slots += static_cast<std::size_t>(search.capacity());
  return slots;
}

}  // namespace

DeviceFrame::DeviceFrame(Backend& backend, int width, int height, const DetectorConfig& config, bool keeps_stages)
    : whole_(MarkerPlan(backend, width, height, config), !config.disc_targets.empty()), stream_(backend.make_stream()) {
  make_windows(backend, config, keeps_stages);
  areas_.reserve(windows_.size() + 1);
  areas_.push_back(&whole_);
  // What a driver compiles, and what operations take when they first run, is not in the first frame's time.
  if (!warm_up()) {
    throw Error(std::string(backend.name()) + ": " + backend.device().name +
                " was lost on the first, empty frame; see berth doctor, or use another backend");
  }
}

void DeviceFrame::make_windows(Backend& backend, const DetectorConfig& config, bool keeps_stages) {
  const MarkerGeometry& g = geometry();
  if (!config.window_sides.empty() && !config.disc_targets.empty()) {
    throw Error("windows show markers alone; targets of discs and rings are looked for in whole frames");
  }
  if (!keeps_stages) scratch_.emplace(backend);
  std::vector<int> sides = config.window_sides;
  std::sort(sides.begin(), sides.end(), std::greater<int>());  // the shared ones are made for the largest
  for (const int side : sides) {
    if (side % 16 != 0 || side < 64 || side > std::min(g.width, g.height)) {
      throw Error("window side " + std::to_string(side) + " is none for " + std::to_string(g.width) + "x" +
                  std::to_string(g.height) + "; give a multiple of 16 from 64 to the image's lesser side");
    }
    windows_.push_back(
        std::make_unique<SearchArea>(MarkerPlan::of_window(backend, side, config, scratch_ ? &*scratch_ : nullptr)));
    windows_.back()->place.side = side;
  }
  if (windows_.empty()) return;
  levels_.emplace(g, whole_.plan.searches()[1].geometry,
                  config.flat_field.empty() ? std::vector<u32>() : pack_gains(config.flat_field, g));
}

View2D<const u8> DeviceFrame::image() {
  const MarkerGeometry& g = geometry();
  return {pixels(), g.width, g.height, g.padded_width};
}

void DeviceFrame::submit() {
  submitted_ns_ = monotonic_ns();
  areas_.clear();
  areas_.push_back(&whole_);
  submitted_ = image();
  whole_.enqueue(*stream_);
  end_submit();
}

/// Another frame's plan must not come before this one's downloads.
void DeviceFrame::end_submit() {
  stream_->flush();
  if (stream_->is_immediate()) done_ns_ = monotonic_ns();
}

/// A plan for the window that the frame does not use yet.
SearchArea& DeviceFrame::free_area(const SearchWindow& window) {
  const MarkerGeometry& g = geometry();
  const auto refuse = [&](const std::string& remedy) {
    throw Error("window of " + std::to_string(window.side) + " px at (" + std::to_string(window.x) + ", " +
                std::to_string(window.y) + "): " + remedy);
  };
  // Sums of what a caller gives could overflow.
  const bool is_inside = window.side > 0 && window.side <= std::min(g.width, g.height) && window.x >= 0 &&
                         window.y >= 0 && window.x <= g.width - window.side && window.y <= g.height - window.side;
  if (!is_inside || window.x % kWindowStep != 0 || window.y % kWindowStep != 0) {
    refuse("give multiples of " + std::to_string(kWindowStep) + " that keep it in the frame of " +
           std::to_string(g.width) + "x" + std::to_string(g.height));
  }
  const auto free = std::find_if(windows_.begin(), windows_.end(), [&](const auto& area) {
    return area->place.side == window.side && std::find(areas_.begin(), areas_.end(), area.get()) == areas_.end();
  });
  if (free == windows_.end()) refuse("name its side in window_sides, as often as a frame needs it");
  return **free;
}

void DeviceFrame::submit_windows(View2D<const u8> frame, const std::vector<SearchWindow>& windows) {
  submitted_ns_ = monotonic_ns();
  areas_.clear();
  for (const SearchWindow& window : windows) {
    SearchArea& area = free_area(window);
    area.place = window;
    areas_.push_back(&area);
  }
  submitted_ = frame;
  const bool is_halved_searched = std::any_of(windows.begin(), windows.end(),
                                              [](const SearchWindow& window) { return !window.full_resolution_only; });
  levels_->measure(frame, is_halved_searched ? 2 : 1);
  for (SearchArea* area : areas_) area->enqueue_window(frame, *levels_, *stream_);
  end_submit();
}

bool DeviceFrame::finish() {
  const bool alive = stream_->finish();
  if (!stream_->is_immediate()) done_ns_ = monotonic_ns();
  return alive;
}

/// Runs the plans on whatever the buffers hold.
bool DeviceFrame::warm_up() {
  stream_->replay(whole_.plan.plan());
  for (const auto& window : windows_) {
    stream_->replay(window->plan.full_resolution_plan());
    stream_->replay(window->plan.plan());
  }
  return stream_->finish();
}

std::size_t DeviceFrame::most_in_area() const {
  std::size_t most = slots_of(whole_);
  for (const auto& window : windows_) most = std::max(most, slots_of(*window));
  return most;
}

std::size_t DeviceFrame::most_in_frame() const {
  std::size_t most = 0;
  for (const auto& window : windows_) most += slots_of(*window);
  return std::max(most, slots_of(whole_));
}

std::size_t DeviceFrame::most_in_frame(int most_windows, double most_pixels) const {
  if (windows_.empty()) return slots_of(whole_);
  // No window has more than the smallest, and so much more for each of its pixels.
  const double least = static_cast<double>(slots_of(*windows_.back()));
  double rate = 0;
  for (const auto& window : windows_) {
    const double pixels = static_cast<double>(window->place.side) * window->place.side;
    rate = std::max(rate, (static_cast<double>(slots_of(*window)) - least) / pixels);
  }
  const double most = most_windows * least + rate * most_pixels;
  return std::max(slots_of(whole_), std::min(most_in_frame(), static_cast<std::size_t>(most) + 1));
}

std::size_t DeviceFrame::device_bytes() const {
  std::size_t bytes = whole_.plan.device_bytes() + (scratch_ ? scratch_->device_bytes() : 0);
  for (const auto& window : windows_) bytes += window->plan.device_bytes();
  return bytes;
}

void DeviceFrame::list_constants(std::vector<ConstantMemory>& to) const {
  whole_.plan.list_constants(to);
  for (const auto& window : windows_) window->plan.list_constants(to);
}

std::size_t DeviceFrame::host_bytes() const {
  std::size_t bytes = whole_.host_bytes();
  for (const auto& window : windows_) bytes += window->host_bytes();
  return bytes;
}

}  // namespace berth
