#include "pipeline/pipeline_backends.hpp"

#include <algorithm>
#include <cstring>
#include <utility>

#include "monotonic.hpp"

namespace berth {
namespace {

std::size_t most_returns(const PipelineConfig& config) {
  if (!config.health || !config.health->recovery) return 0;
  return static_cast<std::size_t>(std::max(0, config.health->recovery->most_returns));
}

}  // namespace

PipelineBackends::PipelineBackends(const PipelineConfig& config, HealthWatch& watch, std::vector<PipelineSlot>& slots)
    : config_(config),
      watch_(watch),
      slots_(slots),
      waiters_(slots.front().devices.size(), config.hang_ns, most_returns(config)),
      returned_(slots.front().devices.size()) {
  make_hosts();
  reserve_results();
  if (watch.is_on()) begin_watch();
  // Last: its thread uses all of this.
  const MarkerGeometry& geometry = slots.front().device().geometry();
  watch.recover_by([this, width = geometry.width, height = geometry.height](std::unique_ptr<Backend> opened) {
    auto frames =
        std::make_unique<ReturnedFrames>(*opened, slots_.size(), width, height, config_.detector, watch_.known());
    frames->backend = std::move(opened);
    frames->waiter = waiters_.make();
    return frames;
  });
}

PipelineBackends::~PipelineBackends() { watch_.stop_recovery(); }

/// Each backend has tables of its own where they are watched, so that one may be left for what happened to them.
void PipelineBackends::make_hosts() {
  const MarkerGeometry& geometry = slots_.front().device().geometry();
  const std::size_t backends = watch_.is_on() ? returned_.size() : 1;
  for (std::size_t i = 0; i < backends; ++i) {
    hosts_.push_back(std::make_unique<HostFinish>(geometry.width, geometry.height, config_.detector));
  }
}

void PipelineBackends::reserve_results() {
  for (PipelineSlot& slot : slots_) {
    const DeviceFrame& device = slot.device();
    std::size_t most = device.most_in_frame();
    if (config_.tracking) {
      const MarkerGeometry& g = device.geometry();
      most = device.most_in_frame(config_.tracking->most_windows, config_.tracking->most_share * g.width * g.height);
    }
    for (const auto& host : hosts_) host->reserve(device, slot.result, most);
  }
}

HostFinish& PipelineBackends::host_on(std::size_t backend) { return *hosts_[std::min(backend, hosts_.size() - 1)]; }

/// Every slot is asked at start, on every backend.
void PipelineBackends::begin_watch() {
  DeviceFrame& first = slots_.front().device();
  // All windows of a side at once may hold more than a frame's windows do.
  for (const auto& host : hosts_) host->reserve(first, known_result_, first.most_in_frame());
  kept_pixels_.resize(first.geometry().frame_bytes());
  for (std::size_t b = 0; b < hosts_.size(); ++b) {
    std::vector<ConstantMemory> constants;
    hosts_[b]->list_constants(constants);
    for (PipelineSlot& slot : slots_) {
      slot.devices[b]->list_constants(constants);
      ask(slot, b, 1, watch_.known().parts());
    }
    watch_.watch(constants, static_cast<int>(b));
  }
}

/// Runs the picture whose answer is known, over what the slot holds: the whole of it, and these parts of it.
bool PipelineBackends::ask(PipelineSlot& slot, std::size_t backend, std::size_t from, std::size_t to) {
  DeviceFrame& device = *slot.devices[backend];
  HostFinish& host = host_on(backend);
  const auto finish = [this, backend](DeviceFrame& frame) { return finish_on(backend, frame); };
  bool is_right = answers(device, host, watch_.known(), 0, known_result_, finish);
  for (std::size_t part = from; is_right && part < to; ++part) {
    is_right = answers(device, host, watch_.known(), part, known_result_, finish);
  }
  watch_.answer(backend, is_right, known_result_.status == FrameStatus::device_lost, monotonic_ns());
  return is_right;
}

bool PipelineBackends::is_believed(PipelineSlot& slot) {
  if (!watch_.is_on() || (asked_ == slot.on && !watch_.is_due(monotonic_ns()))) return true;
  asked_ = slot.on;
  u8* const pixels = slot.device().pixels();
  std::memcpy(kept_pixels_.data(), pixels, kept_pixels_.size());
  const std::size_t windows = watch_.next_windows();
  const bool is_right = ask(slot, slot.on, windows, windows == 0 ? 0 : windows + 1);
  std::memcpy(pixels, kept_pixels_.data(), kept_pixels_.size());
  return is_right;
}

/// Waits for a frame on a backend as it is now, which is left where it is lost or hangs. Whether it came.
bool PipelineBackends::finish_on(std::size_t backend, DeviceFrame& device) {
  using End = DeviceWaiter::End;
  const End end = waiters_.finish(backend, device);
  if (end == End::lost) watch_.lose(backend);
  if (end == End::hangs) watch_.note_hang(backend);
  return end == End::done;
}

bool PipelineBackends::await(PipelineSlot& slot) {
  // Not of a backend that was left, though the same one is back by now.
  return is_current(slot, slot.on) && finish_on(slot.on, slot.device()) && watch_.is_good(slot.on);
}

/// Which backend frames are run on; the last where none is left. Any thread.
std::size_t PipelineBackends::active() const { return std::min(watch_.active(), returned_.size() - 1); }

/// Whether the slot's frame is of the backend as it is now. Any thread that has the slot, as with renew.
bool PipelineBackends::is_current(const PipelineSlot& slot, std::size_t backend) const {
  return slot.origins[backend] == returned_[backend].load(std::memory_order_acquire);
}

/// Gives a slot its frame on a backend that was opened anew. The slot is at no frame there; what it had stays until
/// exchanged() is said.
ReturnedFrames* PipelineBackends::renew(PipelineSlot& slot, std::size_t backend) {
  if (is_current(slot, backend)) return nullptr;
  ReturnedFrames* const frames = returned_[backend].load(std::memory_order_acquire);
  std::swap(slot.devices[backend], frames->devices[static_cast<std::size_t>(slot.frame.slot)]);
  slot.origins[backend] = frames;
  return frames;
}

void PipelineBackends::place(PipelineSlot& slot) {
  slot.on = active();
  if (ReturnedFrames* const renewed = renew(slot, slot.on)) renewed->exchanged();
}

void PipelineBackends::carry_over(PipelineSlot& slot) {
  const std::size_t to = active();
  if (slot.on == to && is_current(slot, to)) return;
  DeviceFrame& before = slot.device();
  ReturnedFrames* const renewed = renew(slot, to);
  DeviceFrame& next = *slot.devices[to];
  pad_frame(before.image(), next.geometry(), next.pixels());
  slot.on = to;
  if (renewed != nullptr) renewed->exchanged();
}

void PipelineBackends::go_back() {
  auto* const frames = static_cast<ReturnedFrames*>(watch_.proven());
  if (frames == nullptr) return;
  std::swap(hosts_[frames->number], frames->host);
  returned_[frames->number].store(frames, std::memory_order_release);
  asked_ = kNone;
  waiters_.exchange(frames->number, frames->waiter);
  watch_.take_back(*frames);
}

}  // namespace berth
