#pragma once

#include <atomic>
#include <memory>
#include <vector>

#include "frame/detector_parts.hpp"
#include "health/health_watch.hpp"
#include "pipeline/device_waiter.hpp"

namespace berth {

/// Runs a part of the known picture on a frame, over what that holds; whether the answer is right. `finish` waits for
/// it, and returns whether it came.
template <class Finish>
bool answers(DeviceFrame& device, HostFinish& host, const KnownAnswer& known, std::size_t part, FrameResult& result,
             const Finish& finish) {
  if (known.windows(part).empty()) {
    pad_frame(known.image(), device.geometry(), device.pixels());
    device.submit();
  } else {
    device.submit_windows(known.image(), known.windows(part));
  }
  if (finish(device)) {
    host.finish(device, result);
  } else {
    HostFinish::give_up(result);
  }
  return known.fits(result, part);
}

/// A pipeline's frames and decoder on a backend that was opened anew. Slots exchange their frames for these one by one,
/// each when it is at no frame; what they had before is then here.
class ReturnedFrames final : public Returned {
 public:
  ReturnedFrames(Backend& opened, std::size_t slots, int width, int height, const DetectorConfig& config,
                 const KnownAnswer& known)
      : host(std::make_unique<HostFinish>(width, height, config)), known_(known) {
    std::vector<ConstantMemory> memory;
    for (std::size_t i = 0; i < slots; ++i) {
      devices.push_back(std::make_unique<DeviceFrame>(opened, width, height, config, config.digests));
      devices[i]->list_constants(memory);
    }
    host->reserve(*devices.front(), result_);
    host->list_constants(memory);
    scrub.add(memory, 0);
  }

  bool is_right() override {
    for (const auto& device : devices) {
      for (std::size_t part = 0; part < known_.parts(); ++part) {
        if (!answers(*device, *host, known_, part, result_, [](DeviceFrame& it) { return it.finish(); })) return false;
      }
    }
    return true;
  }
  bool is_settled() const override { return exchanged_.load(std::memory_order_acquire) == devices.size(); }
  void free_displaced() override {
    if (waiter) waiter->end();
    waiter.reset();
    for (auto& device : devices) device.reset();
    host.reset();
  }
  /// A slot has exchanged its frame, and is done with what it had.
  void exchanged() { exchanged_.fetch_add(1, std::memory_order_release); }

  std::vector<std::unique_ptr<DeviceFrame>> devices;  // by slot
  std::unique_ptr<HostFinish> host;
  /// Shared with the pipeline, which ends it too; null where devices are waited for as long as it takes.
  std::shared_ptr<DeviceWaiter> waiter;

 private:
  const KnownAnswer& known_;
  FrameResult result_;
  std::atomic<std::size_t> exchanged_ = 0;
};

}  // namespace berth
