#include "berth/failover.hpp"

#include <algorithm>
#include <utility>

#include "berth/error.hpp"
#include "frame/detector_parts.hpp"
#include "health/health_watch.hpp"
#include "monotonic.hpp"

namespace berth {
namespace {

/// Whether a detector makes of a part of the known picture what the reference does.
bool answers(Detector& detector, const KnownAnswer& known, std::size_t part, bool& is_lost) {
  const FrameResult& result = detector.detect(known.image(), {}, known.windows(part));
  is_lost = result.status == FrameStatus::device_lost;
  return known.fits(result, part);
}

struct ReturnedDetector final : Returned {
  ReturnedDetector(Backend& opened, int width, int height, const DetectorConfig& config, const KnownAnswer& answer)
      : detector(std::in_place, opened, width, height, config), known(answer) {
    std::vector<ConstantMemory> memory;
    detector->list_constants(memory);
    scrub.add(memory, 0);
  }
  bool is_right() override {
    bool is_lost = false;
    for (std::size_t part = 0; part < known.parts(); ++part) {
      if (!answers(*detector, known, part, is_lost)) return false;
    }
    return true;
  }
  void free_displaced() override { detector.reset(); }

  std::optional<Detector> detector;
  const KnownAnswer& known;
};

}  // namespace

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
    ask(i, true);
  }
  const KnownAnswer& known = watch_->known();
  watch_->recover_by([width, height, config, &known](std::unique_ptr<Backend> opened) {
    auto returned = std::make_unique<ReturnedDetector>(*opened, width, height, config, known);
    returned->backend = std::move(opened);
    return returned;
  });
}

FailoverDetector::~FailoverDetector() = default;
FailoverDetector::FailoverDetector(FailoverDetector&&) noexcept = default;
FailoverDetector& FailoverDetector::operator=(FailoverDetector&& other) noexcept {
  detectors_ = std::move(other.detectors_);  // they go before what has their backends
  watch_ = std::move(other.watch_);
  none_ = std::move(other.none_);
  return *this;
}

/// Runs the picture whose answer is known: `everything`, or the whole of it and the next windows.
void FailoverDetector::ask(std::size_t backend, bool everything) {
  const KnownAnswer& known = watch_->known();
  Detector& detector = detectors_[backend];
  bool is_lost = false;
  bool is_right = answers(detector, known, 0, is_lost);
  const std::size_t next = everything ? 1 : watch_->next_windows();
  const std::size_t end = everything ? known.parts() : next + 1;
  for (std::size_t part = std::max<std::size_t>(next, 1); is_right && part < end; ++part) {
    is_right = answers(detector, known, part, is_lost);
  }
  watch_->answer(backend, is_right, is_lost, monotonic_ns());
}

/// Whether a backend that was left has taken over again.
bool FailoverDetector::go_back() {
  Returned* const returned = watch_->proven();
  if (returned == nullptr) return false;
  std::swap(detectors_[returned->number], *static_cast<ReturnedDetector*>(returned)->detector);
  watch_->take_back(*returned);
  return true;
}

const FrameResult& FailoverDetector::detect(View2D<const u8> image, const FrameStamp& stamp,
                                            const std::vector<SearchWindow>& windows) {
  watch_->scrub();
  // One that takes over is asked first.
  bool is_new = go_back();
  is_new = watch_->is_due(monotonic_ns()) || is_new;
  while (!watch_->has_failed()) {
    const std::size_t backend = watch_->active();
    if (is_new) ask(backend, false);
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
