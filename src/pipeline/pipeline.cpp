#include "berth/pipeline.hpp"

#include <cassert>
#include <cstring>
#include <string>
#include <utility>

#include "berth/error.hpp"
#include "monotonic.hpp"
#include "pipeline/pipeline_backends.hpp"
#include "pipeline/pipeline_config.hpp"
#include "pipeline/pipeline_slot.hpp"
#include "pipeline/pipeline_stages.hpp"
#include "pipeline/pipeline_statistics.hpp"
#include "pipeline/slot_ring.hpp"

namespace berth {

/// The parts of a pipeline. Their order is that of their end, backwards: first the stages' threads, then what waits for
/// devices, then the slots with their frames, and only then the watch with the backends that were opened anew.
struct Pipeline::Impl {
  Impl(const std::vector<Backend*>& backends_given, int width, int height, const PipelineConfig& wanted,
       Deliver callback)
      : config(checked_pipeline(wanted, width, height)),
        deliver(std::move(callback)),
        statistics(config.deadlines_ns),
        ring(config.slots, config.overrun, config.tracking ? config.tracking->behind : 0),
        watch(config.health, width, height, config.detector, backends_given.size()),
        slots(make_slots(backends_given, width, height, config)),
        geometry(slots.front().device().geometry()),
        backends(config, watch, slots),
        memory(memory_of(slots)),
        stages(config, deliver, slots, backends, ring, statistics) {
    memory.host_bytes += sizeof(Impl) + backends.host_bytes();
  }

  const PipelineFrame* fetch(bool waiting) {
    const int slot = ring.fetch(waiting);
    return slot < 0 ? nullptr : &at(slot).frame;
  }

  PipelineSlot& at(int slot) { return slots[static_cast<std::size_t>(slot)]; }

  const PipelineConfig config;
  const Deliver deliver;
  PipelineStatistics statistics;
  SlotRing ring;
  HealthWatch watch;
  std::vector<PipelineSlot> slots;
  /// Taken at the start: slots may get other frames later.
  const MarkerGeometry geometry;
  PipelineBackends backends;
  PipelineMemory memory;
  PipelineStages stages;
  /// The slot that the camera's thread fills; −1 for none.
  int filling = -1;
};

Pipeline::Pipeline(const std::vector<Backend*>& backends, int width, int height, const PipelineConfig& config,
                   Deliver deliver)
    : impl_(std::make_unique<Impl>(backends, width, height, config, std::move(deliver))) {}
Pipeline::~Pipeline() {
  assert(!impl_->stages.is_on_host_thread());  // a callback must not destroy it: see stop
}

void Pipeline::start() { impl_->stages.start(); }
void Pipeline::stop() { impl_->stages.stop(); }
void Pipeline::close() { impl_->ring.close(); }

FrameSlot Pipeline::begin() {
  impl_->filling = impl_->ring.begin();
  if (impl_->filling < 0) return {};
  PipelineSlot& slot = impl_->at(impl_->filling);
  impl_->backends.place(slot);
  const MarkerGeometry& g = slot.device().geometry();
  return {{slot.device().pixels(), g.width, g.height, g.padded_width}, impl_->filling};
}

bool Pipeline::commit(const FrameStamp& stamp) {
  if (impl_->filling < 0) return false;
  PipelineSlot& slot = impl_->at(impl_->filling);
  impl_->filling = -1;
  pad_in_place(slot.device().geometry(), slot.device().pixels());
  slot.result.stamp = stamp;
  slot.arrived_ns = monotonic_ns();
  return impl_->ring.commit();
}

bool Pipeline::push(View2D<const u8> image, const FrameStamp& stamp) {
  const MarkerGeometry& g = impl_->geometry;
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
  impl_->statistics.add_to(counts);
  return counts;
}

const LatencyHistogram& Pipeline::times(Lap lap) const { return impl_->statistics.times(lap); }

HealthReport Pipeline::health() const { return impl_->watch.report(); }

PipelineMemory Pipeline::memory() const { return impl_->memory; }

}  // namespace berth
