#include "berth/failover.hpp"

#include "berth/error.hpp"

namespace berth {

FailoverDetector::FailoverDetector(const std::vector<Backend*>& backends, int width, int height,
                                   const DetectorConfig& config) {
  if (backends.empty()) throw Error("a failover detector needs a backend; give at least one");
  for (Backend* backend : backends) detectors_.emplace_back(*backend, width, height, config);
}

const FrameResult& FailoverDetector::detect(View2D<const u8> image, const FrameStamp& stamp,
                                            const std::vector<SearchWindow>& windows) {
  const FrameResult* result = &detectors_[active_].detect(image, stamp, windows);
  while (result->status == FrameStatus::device_lost && active_ + 1 < detectors_.size()) {
    result = &detectors_[++active_].detect(image, stamp, windows);
  }
  return *result;
}

std::size_t FailoverDetector::device_bytes() const {
  std::size_t bytes = 0;
  for (const Detector& detector : detectors_) bytes += detector.device_bytes();
  return bytes;
}

}  // namespace berth
