#include "pipeline/pipeline_slot.hpp"

#include "berth/error.hpp"

namespace berth {

std::vector<PipelineSlot> make_slots(const std::vector<Backend*>& backends, int width, int height,
                                     const PipelineConfig& config) {
  if (backends.empty()) throw Error("a pipeline needs a backend; give at least one");
  std::vector<PipelineSlot> slots(static_cast<std::size_t>(config.slots));
  for (std::size_t i = 0; i < slots.size(); ++i) {
    PipelineSlot& slot = slots[i];
    slot.origins.resize(backends.size());
    for (Backend* backend : backends) {
      slot.devices.push_back(
          std::make_unique<DeviceFrame>(*backend, width, height, config.detector, config.detector.digests));
    }
    slot.frame.result = &slot.result;
    slot.frame.slot = static_cast<int>(i);
    if (!config.tracking) continue;
    Tracker::reserve(slot.order);
    slot.tracked.windows.reserve(slot.order.windows.capacity());
    slot.tracked.result = &slot.result;
    slot.frame.tracked = &slot.tracked;
  }
  return slots;
}

PipelineMemory memory_of(const std::vector<PipelineSlot>& slots) {
  PipelineMemory memory;
  memory.slots = static_cast<int>(slots.size());
  memory.frame_bytes = slots.front().devices.front()->geometry().frame_bytes();
  for (const PipelineSlot& slot : slots) {
    for (const std::unique_ptr<DeviceFrame>& device : slot.devices) {
      memory.device_bytes += device->device_bytes();
      memory.host_bytes += device->host_bytes();
    }
    memory.host_bytes += sizeof(PipelineSlot) + slot.result.detections.capacity() * sizeof(Detection) +
                         slot.result.bundles.capacity() * sizeof(BundlePose) +
                         slot.result.disc_targets.capacity() * sizeof(DiscPose) +
                         3 * slot.order.windows.capacity() * sizeof(SearchWindow);
  }
  return memory;
}

}  // namespace berth
