#pragma once

#include <cstddef>
#include <vector>

#include "berth/detector.hpp"

namespace berth {

/// Detectors of one configuration on several backends, in order of preference, all made at start. A frame whose device
/// is lost is run again on the next backend, and so are all after it: no frame is lost, and the bits stay the same.
class FailoverDetector {
 public:
  /// The backends outlive this object; there is at least one. Throws Error as Detector does.
  FailoverDetector(const std::vector<Backend*>& backends, int width, int height, const DetectorConfig& config);

  /// FrameStatus::device_lost only when every backend is. Valid until the next call.
  const FrameResult& detect(View2D<const u8> image, const FrameStamp& stamp = {},
                            const std::vector<SearchWindow>& windows = {});
  /// Which of the backends gave the last result.
  std::size_t active() const { return active_; }
  std::size_t device_bytes() const;

 private:
  std::vector<Detector> detectors_;
  std::size_t active_ = 0;
};

}  // namespace berth
