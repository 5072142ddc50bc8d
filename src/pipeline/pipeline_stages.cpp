#include "pipeline/pipeline_stages.hpp"

#include <algorithm>
#include <utility>

#include "berth/error.hpp"
#include "monotonic.hpp"
#include "pipeline/thread_setup.hpp"

namespace berth {
namespace {

/// On a host's thread, the stages whose it is. Of the thread itself, so that no id is compared that another thread may
/// have by now.
thread_local const void* host_of = nullptr;

}  // namespace

PipelineStages::PipelineStages(const PipelineConfig& config, const Pipeline::Deliver& deliver,
                               std::vector<PipelineSlot>& slots, PipelineBackends& backends, SlotRing& ring,
                               PipelineStatistics& statistics)
    : config_(config), deliver_(deliver), slots_(slots), backends_(backends), ring_(ring), statistics_(statistics) {
  const MarkerGeometry& geometry = slots.front().device().geometry();
  if (config.tracking) tracker_.emplace(geometry.width, geometry.height, *config.tracking);
  ring.close();  // until start: a frame that nobody takes would stand in no count
}

bool PipelineStages::is_on_host_thread() const { return host_of == this; }

void PipelineStages::start() {
  if (device_thread_.joinable()) throw Error("the pipeline is running; stop it before it is started again");
  ring_.reopen();
  if (tracker_) tracker_->reset();
  error_ = nullptr;
  failed_ = false;
  statistics_.clear();
  std::promise<void> device_ready;
  std::promise<void> host_ready;
  std::future<void> device_set = device_ready.get_future();
  std::future<void> host_set = host_ready.get_future();
  try {
    device_thread_ = std::thread([this, ready = std::move(device_ready)]() mutable { run_device(ready); });
    host_thread_ = std::thread([this, ready = std::move(host_ready)]() mutable { run_host(ready); });
    device_set.get();
    host_set.get();
  } catch (...) {
    end();
    throw;
  }
}

void PipelineStages::stop() {
  // The thread would wait for its own end.
  if (is_on_host_thread()) throw Error("stop called from a callback; call close() there, stop on another thread");
  // With a callback, what is under way still gets there.
  if (deliver_) {
    ring_.close();
    join();
  }
  end();
  if (error_) std::rethrow_exception(std::exchange(error_, nullptr));
}

void PipelineStages::join() {
  if (device_thread_.joinable()) device_thread_.join();
  if (host_thread_.joinable()) host_thread_.join();
}

void PipelineStages::end() {
  ring_.close();
  ring_.discard();
  join();
}

/// Name, core and priority of the calling thread; `index` 0 is the device's, 1 the host's.
void PipelineStages::set_up(std::size_t index) const {
  name_thread(index == 0 ? "berth-device" : "berth-host");
  if (!config_.cores.empty()) pin_to_core(config_.cores[std::min(index, config_.cores.size() - 1)]);
  if (config_.realtime_priority > 0) make_realtime(config_.realtime_priority);
}

/// Within a catch, on either thread: the first error is the one that stop throws. What is under way is dropped.
void PipelineStages::fail() {
  if (!failed_.exchange(true)) error_ = std::current_exception();
  ring_.close();
  ring_.discard();
}

void PipelineStages::run_device(std::promise<void>& ready) {
  try {
    set_up(0);
    ready.set_value();
  } catch (...) {
    ready.set_exception(std::current_exception());
  }
  bool again = false;
  for (int i = ring_.take(again); i >= 0; i = ring_.take(again)) {
    PipelineSlot& slot = at(i);
    slot.submitted = false;
    try {
      submit(slot, again);
      slot.submitted = true;
    } catch (...) {
      fail();
    }
    ring_.on_device(i);  // failed ones too: the host's thread drops them in their turn
  }
}

void PipelineStages::submit(PipelineSlot& slot, bool again) {
  backends_.carry_over(slot);
  if (!again) slot.taken_ns = monotonic_ns();
  DeviceFrame& device = slot.device();
  if (tracker_ && !failed_ && !again) tracker_->next(slot.result.stamp, slot.order);
  if (slot.order.windows.empty()) {
    device.submit();
  } else {
    device.submit_windows(device.image(), slot.order.windows);
  }
}

void PipelineStages::run_host(std::promise<void>& ready) {
  host_of = this;
  try {
    set_up(1);
    ready.set_value();
  } catch (...) {
    ready.set_exception(std::current_exception());
  }
  for (int i = ring_.await(); i >= 0; i = ring_.await()) {
    try {
      finish(i);
    } catch (...) {
      fail();
    }
    ring_.done(i, !deliver_);
  }
}

void PipelineStages::finish(int i) {
  PipelineSlot& slot = at(i);
  backends_.go_back();
  std::int64_t began_ns = make_result(i);
  if (tracker_) {
    // What was lost in its windows is searched whole before any later result is looked at.
    while (slot.submitted && !failed_ && !tracker_->take(slot.order, slot.result)) {
      ring_.run_again(i);
      began_ns = make_result(i);
    }
  }
  if (!slot.submitted) return;
  if (tracker_ && !failed_) slot.tracked = tracker_->frame();
  ring_.settled();
  if (slot.result.status == FrameStatus::device_lost) statistics_.count_device_lost();
  statistics_.take_times(slot, began_ns);
  slot.frame.image = slot.device().image();
  slot.frame.backend = slot.on;
  if (!deliver_ || failed_) return;
  ring_.delivering();
  deliver_(slot.frame);
}

/// Waits for the frame and makes its result, unless enqueueing it has thrown. Returns when the host took it up.
std::int64_t PipelineStages::make_result(int i) {
  PipelineSlot& slot = at(i);
  backends_.check_memory();
  for (;;) {
    const bool alive = wait_for_device(i);
    const std::int64_t began_ns = monotonic_ns();
    if (!slot.submitted) return began_ns;
    ring_.on_host();
    slot.submitted_ns = slot.device().submitted_ns();
    slot.done_ns = slot.device().done_ns();
    if (!alive) {
      HostFinish::give_up(slot.result);
      return began_ns;
    }
    backends_.finish(slot);
    if (backends_.is_believed(slot)) return began_ns;
  }
}

/// Waits for the frame; one whose device was lost, or is not believed any more, runs again on the next backend, as all
/// after it do.
bool PipelineStages::wait_for_device(int i) {
  PipelineSlot& slot = at(i);
  while (slot.submitted) {
    if (backends_.await(slot)) return true;
    if (backends_.has_failed()) return false;
    statistics_.count_run_again();
    ring_.run_again(i);
  }
  return true;
}

}  // namespace berth
