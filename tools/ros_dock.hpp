#pragma once

#include <string>

#include "berth/detector.hpp"
#include "berth/frame.hpp"

namespace berth::cli {

/// Which of the things that a frame may show is the dock.
class RosDock {
 public:
  struct Seen {
    /// Null where the frame does not show it.
    const Pose* pose = nullptr;
    /// Null where none was computed.
    const std::array<double, 36>* covariance = nullptr;
  };

  /// `name`: of a bundle or a target, or FAMILY:ID. Empty: the first bundle, else the first target, else the first
  /// marker with a pose, from then on. Throws Error where there is no such thing.
  RosDock(const std::string& name, const DetectorConfig& config);

  /// Valid as long as the result.
  Seen in(const FrameResult& result);

 private:
  enum class Kind { any_marker, marker, bundle, target };
  Kind kind_ = Kind::any_marker;
  std::size_t index_ = 0;
  const MarkerFamily* family_ = nullptr;
  int id_ = 0;
};

}  // namespace berth::cli
