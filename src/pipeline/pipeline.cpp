#include "berth/pipeline.hpp"

#include <algorithm>
#include <atomic>
#include <cassert>
#include <cstring>
#include <exception>
#include <future>
#include <optional>
#include <string>
#include <thread>
#include <utility>

#include "berth/error.hpp"
#include "frame/detector_parts.hpp"
#include "health/health_watch.hpp"
#include "monotonic.hpp"
#include "pipeline/returned_frames.hpp"
#include "pipeline/slot_ring.hpp"
#include "pipeline/thread_setup.hpp"

namespace berth {

const char* name_of(Lap lap) {
  static constexpr std::array<const char*, kLaps> kNames = {"wait",    "device", "queue",  "decode",
                                                            "corners", "pose",   "latency"};
  return kNames[static_cast<std::size_t>(lap)];
}

const char* name_of(DropCause cause) {
  static constexpr std::array<const char*, kDropCauses> kNames = {"device", "host", "reader"};
  return kNames[static_cast<std::size_t>(cause)];
}

namespace {

constexpr int kMostSlots = 1024;

PipelineConfig checked(PipelineConfig config, int width, int height) {
  if (config.slots < 2 || config.slots > kMostSlots) {
    throw Error("a pipeline of " + std::to_string(config.slots) + " slots; give 2 to " + std::to_string(kMostSlots) +
                ", usually 4");
  }
  if (config.realtime_priority < 0 || config.realtime_priority > 99) {
    throw Error("real-time priority " + std::to_string(config.realtime_priority) + "; give 1 to 99, or 0 for none");
  }
  if (config.cores.size() > 2) {
    throw Error(std::to_string(config.cores.size()) +
                " cores for a pipeline's threads; give two, the device's and the host's, or one for both");
  }
  if (config.hang_ns < 0) {
    throw Error("a device that hangs after " + std::to_string(config.hang_ns) +
                " ns; give more than 0, or 0 for never");
  }
  for (const std::int64_t deadline : config.deadlines_ns) {
    if (deadline <= 0) throw Error("a deadline of " + std::to_string(deadline) + " ns; give more than 0");
  }
  if (!config.tracking) return config;
  if (config.tracking->behind >= config.slots) {
    throw Error("windows by the result " + std::to_string(config.tracking->behind) +
                " frames before, in a pipeline of " + std::to_string(config.slots) +
                " slots; give fewer frames or more slots");
  }
  config.detector.window_sides = tracking_window_sides(width, height, *config.tracking);
  return config;
}

/// One slot: a frame on each backend, of which one has the pixels, and its result.
struct Slot {
  std::vector<std::unique_ptr<DeviceFrame>> devices;
  /// Which backends, opened anew, they are of; null for those that the pipeline was made with.
  std::vector<const ReturnedFrames*> origins;
  std::size_t on = 0;
  /// False where enqueueing has thrown: there is nothing to wait for then.
  bool submitted = false;
  FrameResult result;
  /// With a tracker: where it is to be searched, and where it was.
  SearchOrder order;
  TrackedFrame tracked;
  std::int64_t arrived_ns = 0, taken_ns = 0, submitted_ns = 0, done_ns = 0;
  PipelineFrame frame;

  DeviceFrame& device() { return *devices[on]; }
};

/// On a host's thread, the pipeline whose it is. Of the thread itself, so that no id is compared that another thread
/// may have by now.
thread_local const void* host_of = nullptr;

void count_one(std::atomic<u64>& counter) {
  counter.store(counter.load(std::memory_order_relaxed) + 1, std::memory_order_relaxed);
}

}  // namespace

struct Pipeline::Impl {
  Impl(const std::vector<Backend*>& backends, int width, int height, const PipelineConfig& wanted, Deliver callback)
      : config(checked(wanted, width, height)),
        deliver(std::move(callback)),
        watch(config.health, width, height, config.detector, backends.size()),
        ring(config.slots, config.overrun, config.tracking ? config.tracking->behind : 0),
        returned(backends.size()) {
    if (backends.empty()) throw Error("a pipeline needs a backend; give at least one");
    if (config.tracking) tracker.emplace(width, height, *config.tracking);
    slots.resize(static_cast<std::size_t>(config.slots));
    for (std::size_t i = 0; i < slots.size(); ++i) {
      Slot& slot = slots[i];
      slot.origins.resize(backends.size());
      for (Backend* backend : backends) {
        slot.devices.push_back(
            std::make_unique<DeviceFrame>(*backend, width, height, config.detector, config.detector.digests));
      }
      if (i == 0) make_hosts(width, height, backends.size());
      for (const auto& host : hosts) {
        host->reserve(slot.device(), slot.result, most_in_frame(slot.device(), width, height));
      }
      slot.frame.result = &slot.result;
      slot.frame.slot = static_cast<int>(i);
      if (!tracker) continue;
      Tracker::reserve(slot.order);
      slot.tracked.windows.reserve(slot.order.windows.capacity());
      slot.tracked.result = &slot.result;
      slot.frame.tracked = &slot.tracked;
    }
    make_waiters();
    note_sizes();
    if (watch.is_on()) begin_watch();
    ring.close();  // until start: a frame that nobody takes would stand in no count
    watch.recover_by([this, width, height](std::unique_ptr<Backend> opened) {
      auto frames =
          std::make_unique<ReturnedFrames>(*opened, slots.size(), width, height, config.detector, watch.known());
      frames->backend = std::move(opened);
      if (!waiters.empty()) frames->waiter = std::make_shared<DeviceWaiter>();
      return frames;
    });
  }

  ~Impl() {
    end();
    watch.stop_recovery();
    // Before the frames that they may still be at.
    for (const auto& waiter : all_waiters) waiter->end();
  }

  std::size_t most_in_frame(const DeviceFrame& device, int width, int height) const {
    if (!config.tracking) return device.most_in_frame();
    return device.most_in_frame(config.tracking->most_windows, config.tracking->most_share * width * height);
  }

  void note_sizes() {
    geometry = slots.front().device().geometry();
    memory.slots = config.slots;
    memory.frame_bytes = geometry->frame_bytes();
    memory.host_bytes = sizeof(Impl);
    for (const Slot& slot : slots) {
      for (const std::unique_ptr<DeviceFrame>& device : slot.devices) {
        memory.device_bytes += device->device_bytes();
        memory.host_bytes += device->host_bytes();
      }
      memory.host_bytes += sizeof(Slot) + slot.result.detections.capacity() * sizeof(Detection) +
                           slot.result.bundles.capacity() * sizeof(BundlePose) +
                           slot.result.disc_targets.capacity() * sizeof(DiscPose) +
                           3 * slot.order.windows.capacity() * sizeof(SearchWindow);
    }
  }

  /// Each backend has tables of its own where they are watched, so that one may be left for what happened to them.
  void make_hosts(int width, int height, std::size_t backends) {
    for (std::size_t i = 0; i < (watch.is_on() ? backends : 1); ++i) {
      hosts.push_back(std::make_unique<HostFinish>(width, height, config.detector));
    }
  }

  HostFinish& host_on(std::size_t backend) { return *hosts[std::min(backend, hosts.size() - 1)]; }

  /// Every slot is asked at start, on every backend.
  void begin_watch() {
    DeviceFrame& first = slots.front().device();
    // All windows of a side at once may hold more than a frame's windows do.
    for (const auto& host : hosts) host->reserve(first, known_result, first.most_in_frame());
    kept_pixels.resize(first.geometry().frame_bytes());
    memory.host_bytes += kept_pixels.size();
    for (std::size_t b = 0; b < hosts.size(); ++b) {
      std::vector<ConstantMemory> constants;
      hosts[b]->list_constants(constants);
      for (Slot& slot : slots) {
        slot.devices[b]->list_constants(constants);
        ask(slot, b, 1, watch.known().parts());
      }
      watch.watch(constants, static_cast<int>(b));
    }
  }

  /// Runs the picture whose answer is known, over what the slot holds: the whole of it, and these parts of it.
  bool ask(Slot& slot, std::size_t backend, std::size_t from, std::size_t to) {
    DeviceFrame& device = *slot.devices[backend];
    HostFinish& host = host_on(backend);
    const auto finish = [this, backend](DeviceFrame& frame) { return finish_on(backend, frame); };
    bool is_right = answers(device, host, watch.known(), 0, known_result, finish);
    for (std::size_t part = from; is_right && part < to; ++part) {
      is_right = answers(device, host, watch.known(), part, known_result, finish);
    }
    watch.answer(backend, is_right, known_result.status == FrameStatus::device_lost, monotonic_ns());
    return is_right;
  }

  /// The same where it is due, or the backend has just taken over; the slot's frame stays.
  bool is_believed(Slot& slot) {
    if (!watch.is_on() || (asked == slot.on && !watch.is_due(monotonic_ns()))) return true;
    asked = slot.on;
    u8* const pixels = slot.device().pixels();
    std::memcpy(kept_pixels.data(), pixels, kept_pixels.size());
    const std::size_t windows = watch.next_windows();
    const bool is_right = ask(slot, slot.on, windows, windows == 0 ? 0 : windows + 1);
    std::memcpy(pixels, kept_pixels.data(), kept_pixels.size());
    return is_right;
  }

  /// Which backend frames are run on; the last where none is left.
  std::size_t active() const { return std::min(watch.active(), slots.front().devices.size() - 1); }

  Slot& at(int slot) { return slots[static_cast<std::size_t>(slot)]; }

  /// A thread that waits for each device, where one may hang. Their list never grows while frames fly.
  void make_waiters() {
    if (config.hang_ns == 0) return;
    const std::size_t backends = slots.front().devices.size();
    const bool recovers = config.health && config.health->recovery;
    const int returns = recovers ? std::max(0, config.health->recovery->most_returns) : 0;
    all_waiters.reserve(backends * (1 + static_cast<std::size_t>(returns)));
    for (std::size_t i = 0; i < backends; ++i) all_waiters.push_back(std::make_shared<DeviceWaiter>());
    waiters = all_waiters;
  }

  /// Waits for a frame on a backend as it is now, which is left where it is lost or hangs. Whether it came.
  bool finish_on(std::size_t backend, DeviceFrame& device) {
    using End = DeviceWaiter::End;
    const bool is_plain = waiters.empty() || device.stream().is_immediate();
    const End end = !is_plain         ? waiters[backend]->finish(device, config.hang_ns)
                    : device.finish() ? End::done
                                      : End::lost;
    if (end == End::lost) watch.lose(backend);
    if (end == End::hangs) watch.note_hang(backend);
    return end == End::done;
  }

  /// Whether the slot's frame is of the backend as it is now.
  bool is_current(const Slot& slot, std::size_t backend) const {
    return slot.origins[backend] == returned[backend].load(std::memory_order_acquire);
  }

  /// Gives a slot its frame on a backend that was opened anew. Called by whoever has the slot, which is at no frame
  /// there; what it had stays until exchanged() is said.
  ReturnedFrames* renew(Slot& slot, std::size_t backend) {
    if (is_current(slot, backend)) return nullptr;
    ReturnedFrames* const frames = returned[backend].load(std::memory_order_acquire);
    std::swap(slot.devices[backend], frames->devices[static_cast<std::size_t>(slot.frame.slot)]);
    slot.origins[backend] = frames;
    return frames;
  }

  /// The host's thread, between two frames: has a backend take over again that has proven itself.
  void go_back() {
    auto* const frames = static_cast<ReturnedFrames*>(watch.proven());
    if (frames == nullptr) return;
    std::swap(hosts[frames->number], frames->host);
    returned[frames->number].store(frames, std::memory_order_release);
    asked = kNone;
    if (!waiters.empty()) {
      std::swap(waiters[frames->number], frames->waiter);
      all_waiters.push_back(waiters[frames->number]);
    }
    watch.take_back(*frames);
  }

  void start() {
    if (device_thread.joinable()) throw Error("the pipeline is running; stop it before it is started again");
    ring.reopen();
    if (tracker) tracker->reset();
    error = nullptr;
    failed = false;
    for (LatencyHistogram& lap : laps) lap.clear();
    for (std::atomic<u64>* counter : {&run_again, &device_lost, &late[0], &late[1]}) *counter = 0;
    std::promise<void> device_ready;
    std::promise<void> host_ready;
    std::future<void> device_set = device_ready.get_future();
    std::future<void> host_set = host_ready.get_future();
    try {
      device_thread = std::thread([this, ready = std::move(device_ready)]() mutable { run_device(ready); });
      host_thread = std::thread([this, ready = std::move(host_ready)]() mutable { run_host(ready); });
      device_set.get();
      host_set.get();
    } catch (...) {
      end();
      throw;
    }
  }

  void end() {
    ring.close();
    ring.discard();
    if (device_thread.joinable()) device_thread.join();
    if (host_thread.joinable()) host_thread.join();
  }

  /// Name, core and priority of the calling thread; `index` 0 is the device's, 1 the host's.
  void set_up(std::size_t index) const {
    name_thread(index == 0 ? "berth-device" : "berth-host");
    if (!config.cores.empty()) pin_to_core(config.cores[std::min(index, config.cores.size() - 1)]);
    if (config.realtime_priority > 0) make_realtime(config.realtime_priority);
  }

  void run_device(std::promise<void>& ready) {
    try {
      set_up(0);
      ready.set_value();
    } catch (...) {
      ready.set_exception(std::current_exception());
    }
    bool again = false;
    for (int i = ring.take(again); i >= 0; i = ring.take(again)) {
      Slot& slot = at(i);
      slot.submitted = false;
      try {
        submit(slot, again);
        slot.submitted = true;
      } catch (...) {
        fail();
      }
      ring.on_device(i);  // failed ones too: the host's thread drops them in their turn
    }
  }

  void submit(Slot& slot, bool again) {
    const std::size_t to = active();
    if (slot.on != to || !is_current(slot, to)) {
      DeviceFrame& before = slot.device();
      ReturnedFrames* const renewed = renew(slot, to);
      DeviceFrame& next = *slot.devices[to];
      pad_frame(before.image(), next.geometry(), next.pixels());
      slot.on = to;
      if (renewed != nullptr) renewed->exchanged();
    }
    if (!again) slot.taken_ns = monotonic_ns();
    DeviceFrame& device = slot.device();
    if (tracker && !failed && !again) tracker->next(slot.result.stamp, slot.order);
    if (slot.order.windows.empty()) {
      device.submit();
    } else {
      device.submit_windows(device.image(), slot.order.windows);
    }
  }

  void run_host(std::promise<void>& ready) {
    host_of = this;
    try {
      set_up(1);
      ready.set_value();
    } catch (...) {
      ready.set_exception(std::current_exception());
    }
    for (int i = ring.await(); i >= 0; i = ring.await()) {
      try {
        finish(i);
      } catch (...) {
        fail();
      }
      ring.done(i, !deliver);
    }
  }

  void finish(int i) {
    Slot& slot = at(i);
    go_back();
    std::int64_t began_ns = make_result(i);
    if (tracker) {
      // What was lost in its windows is searched whole before any later result is looked at.
      while (slot.submitted && !failed && !tracker->take(slot.order, slot.result)) {
        ring.run_again(i);
        began_ns = make_result(i);
      }
    }
    if (!slot.submitted) return;
    if (tracker && !failed) slot.tracked = tracker->frame();
    ring.settled();
    if (slot.result.status == FrameStatus::device_lost) count_one(device_lost);
    take_times(slot, began_ns);
    if (!deliver || failed) return;
    ring.delivering();
    deliver(slot.frame);
  }

  /// Waits for the frame and makes its result, unless enqueueing it has thrown. Returns when the host took it up.
  std::int64_t make_result(int i) {
    Slot& slot = at(i);
    watch.scrub();
    for (;;) {
      const bool alive = wait_for_device(i);
      const std::int64_t began_ns = monotonic_ns();
      if (!slot.submitted) return began_ns;
      ring.on_host();
      slot.submitted_ns = slot.device().submitted_ns();
      slot.done_ns = slot.device().done_ns();
      if (!alive) {
        HostFinish::give_up(slot.result);
        return began_ns;
      }
      host_on(slot.on).finish(slot.device(), slot.result);
      if (is_believed(slot)) return began_ns;
    }
  }

  /// Within a catch, on either thread: the first error is the one that stop throws. What is under way is dropped.
  void fail() {
    if (!failed.exchange(true)) error = std::current_exception();
    ring.close();
    ring.discard();
  }

  /// Waits for the frame; one whose device was lost, or is not believed any more, runs again on the next backend, as
  /// all after it do.
  bool wait_for_device(int i) {
    Slot& slot = at(i);
    while (slot.submitted) {
      // Not of a backend that was left, though the same one is back by now.
      if (is_current(slot, slot.on) && finish_on(slot.on, slot.device()) && watch.is_good(slot.on)) return true;
      if (watch.has_failed()) return false;
      count_one(run_again);
      ring.run_again(i);
    }
    return true;
  }

  void take_times(Slot& slot, std::int64_t began_ns) {
    const std::int64_t now_ns = monotonic_ns();
    DeviceFrame& device = slot.device();
    std::array<std::int64_t, kLaps>& ns = slot.frame.laps_ns;
    ns.fill(0);
    const auto lap = [&ns](Lap which) -> std::int64_t& { return ns[static_cast<std::size_t>(which)]; };
    lap(Lap::wait) = slot.taken_ns - slot.arrived_ns;
    lap(Lap::device) = slot.done_ns - slot.submitted_ns;
    lap(Lap::queue) = began_ns - slot.done_ns;
    if (slot.result.status != FrameStatus::device_lost) {
      lap(Lap::decode) = slot.result.times[1].ns;
      lap(Lap::pose) = slot.result.times[2].ns + slot.result.times[4].ns;
      if (slot.result.times[3].stage[0] != '\0') lap(Lap::corners) = slot.result.times[3].ns;
    }
    const FrameStamp& stamp = slot.result.stamp;
    const bool is_timed = std::strcmp(stamp.clock, "monotonic") == 0;
    lap(Lap::latency) = now_ns - (is_timed ? stamp.mid_exposure_ns : slot.arrived_ns);
    slot.frame.image = device.image();
    slot.frame.backend = slot.on;
    for (std::size_t i = 0; i < kLaps; ++i) laps[i].add(ns[i]);
    for (std::size_t i = 0; i < late.size(); ++i) {
      if (lap(Lap::latency) > config.deadlines_ns[i]) count_one(late[i]);
    }
  }

  const PipelineFrame* fetch(bool waiting) {
    const int slot = ring.fetch(waiting);
    return slot < 0 ? nullptr : &at(slot).frame;
  }

  const PipelineConfig config;
  const Deliver deliver;
  /// Which backends can be believed; only the host's thread, which sees a loss, changes that. Before the slots: it has
  /// the backends that were opened anew.
  HealthWatch watch;
  std::vector<Slot> slots;
  std::vector<std::unique_ptr<HostFinish>> hosts;
  /// By backend, the host's thread's; and all there ever were.
  std::vector<std::shared_ptr<DeviceWaiter>> waiters, all_waiters;
  /// The device's thread asks it for windows, the host's thread gives it results; the ring keeps them apart.
  std::optional<Tracker> tracker;
  SlotRing ring;
  /// By backend: the last that took over again, null before.
  std::vector<std::atomic<ReturnedFrames*>> returned;
  /// Taken at the start: slots may get other frames later.
  std::optional<MarkerGeometry> geometry;
  PipelineMemory memory;
  /// The host's thread's: of the known picture, and which backend was asked last.
  FrameResult known_result;
  std::vector<u8> kept_pixels;
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);
  std::size_t asked = 0;
  std::atomic<u64> run_again = 0, device_lost = 0;
  std::array<std::atomic<u64>, 2> late = {};
  std::array<LatencyHistogram, kLaps> laps;
  /// Whether something was thrown, and what: whoever sets the one writes the other, which is read once both are joined.
  std::atomic<bool> failed = false;
  std::exception_ptr error;
  int filling = -1;
  std::thread device_thread, host_thread;
};

Pipeline::Pipeline(const std::vector<Backend*>& backends, int width, int height, const PipelineConfig& config,
                   Deliver deliver)
    : impl_(std::make_unique<Impl>(backends, width, height, config, std::move(deliver))) {}
Pipeline::~Pipeline() {
  assert(host_of != impl_.get());  // a callback must not destroy it: see stop
}

void Pipeline::start() { impl_->start(); }
void Pipeline::stop() {
  // The thread would wait for its own end.
  if (host_of == impl_.get()) throw Error("stop called from a callback; call close() there, stop on another thread");
  // With a callback, what is under way still gets there.
  if (impl_->deliver) {
    impl_->ring.close();
    if (impl_->device_thread.joinable()) impl_->device_thread.join();
    if (impl_->host_thread.joinable()) impl_->host_thread.join();
  }
  impl_->end();
  if (impl_->error) std::rethrow_exception(std::exchange(impl_->error, nullptr));
}
void Pipeline::close() { impl_->ring.close(); }

FrameSlot Pipeline::begin() {
  impl_->filling = impl_->ring.begin();
  if (impl_->filling < 0) return {};
  Slot& slot = impl_->at(impl_->filling);
  slot.on = impl_->active();
  if (ReturnedFrames* const renewed = impl_->renew(slot, slot.on)) renewed->exchanged();
  const MarkerGeometry& g = slot.device().geometry();
  return {{slot.device().pixels(), g.width, g.height, g.padded_width}, impl_->filling};
}

bool Pipeline::commit(const FrameStamp& stamp) {
  if (impl_->filling < 0) return false;
  Slot& slot = impl_->at(impl_->filling);
  impl_->filling = -1;
  pad_in_place(slot.device().geometry(), slot.device().pixels());
  slot.result.stamp = stamp;
  slot.arrived_ns = monotonic_ns();
  return impl_->ring.commit();
}

bool Pipeline::push(View2D<const u8> image, const FrameStamp& stamp) {
  const MarkerGeometry& g = *impl_->geometry;
  if (image.width != g.width || image.height != g.height) {
    throw Error("frame is " + std::to_string(image.width) + "x" + std::to_string(image.height) +
                "; this pipeline was made for " + std::to_string(g.width) + "x" + std::to_string(g.height));
  }
  const FrameSlot slot = begin();
  if (slot.image.data == nullptr) return false;
  for (int y = 0; y < image.height; ++y) {
    std::memcpy(slot.image.row(y), image.row(y), static_cast<std::size_t>(image.width));
  }
  return commit(stamp);
}

const PipelineFrame* Pipeline::poll() { return impl_->fetch(false); }
const PipelineFrame* Pipeline::next() { return impl_->fetch(true); }

PipelineCounts Pipeline::counts() const {
  PipelineCounts counts = impl_->ring.counts();
  counts.run_again = impl_->run_again;
  counts.device_lost = impl_->device_lost;
  for (std::size_t i = 0; i < counts.late.size(); ++i) counts.late[i] = impl_->late[i];
  return counts;
}

const LatencyHistogram& Pipeline::times(Lap lap) const { return impl_->laps[static_cast<std::size_t>(lap)]; }

HealthReport Pipeline::health() const { return impl_->watch.report(); }

PipelineMemory Pipeline::memory() const { return impl_->memory; }

}  // namespace berth
