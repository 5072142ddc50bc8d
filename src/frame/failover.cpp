#include "berth/failover.hpp"

#include <algorithm>

#include "berth/error.hpp"
#include "frame/detector_parts.hpp"
#include "health/health_watch.hpp"
#include "monotonic.hpp"

namespace berth {

FailoverDetector::FailoverDetector(const std::vector<Backend*>& backends, int width, int height,
                                   const DetectorConfig& config, const std::optional<HealthConfig>& health) {
  if (backends.empty()) throw Error("a failover detector needs a backend; give at least one");
  for (Backend* backend : backends) detectors_.emplace_back(*backend, width, height, config);
  watch_ = std::make_unique<HealthWatch>(health, width, height, config, backends.size());
  none_.bundles.resize(config.bundles.size());
  none_.disc_targets.resize(config.disc_targets.size());
  if (!watch_->is_on()) return;
  for (std::size_t i = 0; i < detectors_.size(); ++i) {
    std::vector<ConstantMemory> memory;
    detectors_[i].list_constants(memory);
    watch_->watch(memory, static_cast<int>(i));
    ask(i);
  }
}

FailoverDetector::~FailoverDetector() = default;
FailoverDetector::FailoverDetector(FailoverDetector&&) noexcept = default;
FailoverDetector& FailoverDetector::operator=(FailoverDetector&&) noexcept = default;

/// Runs the picture whose answer is known.
void FailoverDetector::ask(std::size_t backend) {
  watch_->answer(backend, detectors_[backend].detect(watch_->picture()), monotonic_ns());
}

const FrameResult& FailoverDetector::detect(View2D<const u8> image, const FrameStamp& stamp,
                                            const std::vector<SearchWindow>& windows) {
  watch_->scrub();
  // One that takes over is asked first.
  bool is_new = watch_->is_due(monotonic_ns());
  while (!watch_->has_failed()) {
    const std::size_t backend = watch_->active();
    if (is_new) ask(backend);
    if (watch_->active() != backend) continue;
    const FrameResult& result = detectors_[backend].detect(image, stamp, windows);
    if (result.status != FrameStatus::device_lost) return result;
    watch_->lose(backend);
    is_new = watch_->is_on();
  }
  HostFinish::give_up(none_);
  none_.stamp = stamp;
  return none_;
}

std::size_t FailoverDetector::active() const { return std::min(watch_->active(), detectors_.size() - 1); }

HealthReport FailoverDetector::health() const { return watch_->report(); }

std::size_t FailoverDetector::device_bytes() const {
  std::size_t bytes = 0;
  for (const Detector& detector : detectors_) bytes += detector.device_bytes();
  return bytes;
}

}  // namespace berth
