#pragma once

#include <cstddef>
#include <memory>
#include <optional>
#include <vector>

#include "berth/detector.hpp"
#include "berth/health.hpp"

namespace berth {

class HealthWatch;

/// Detectors of one configuration on several backends, in order of preference, all made at start. A frame whose device
/// is lost is run again on the next backend, and so are all after it: no frame is lost, and the bits stay the same.
/// With a HealthConfig a backend is also left for a wrong known answer, or where memory of its detector was altered;
/// with its RecoveryConfig one that was left is opened anew meanwhile, and gone back to before a frame once it has
/// proven itself.
class FailoverDetector {
 public:
  /// The backends outlive this object; there is at least one. Throws Error as Detector does.
  FailoverDetector(const std::vector<Backend*>& backends, int width, int height, const DetectorConfig& config,
                   const std::optional<HealthConfig>& health = std::nullopt);
  ~FailoverDetector();
  FailoverDetector(FailoverDetector&&) noexcept;
  FailoverDetector& operator=(FailoverDetector&&) noexcept;

  /// FrameStatus::device_lost only when every backend is, or none can be believed. Valid until the next call.
  const FrameResult& detect(View2D<const u8> image, const FrameStamp& stamp = {},
                            const std::vector<SearchWindow>& windows = {});
  /// Which of the backends gave the last result, the last of them where none did.
  std::size_t active() const;
  HealthReport health() const;
  std::size_t device_bytes() const;

 private:
  void ask(std::size_t backend, bool everything);
  bool go_back();

  std::unique_ptr<HealthWatch> watch_;  // first: it has the backends that were opened anew
  std::vector<Detector> detectors_;
  FrameResult none_;  // where no backend is left
};

}  // namespace berth
