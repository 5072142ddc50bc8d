#pragma once

#include <vector>

#include "ros2/messages.hpp"

namespace berth::ros2 {

/// One of each message, with values in every field; ros2/read_messages.py knows them too.
class SampleMessages {
 public:
  SampleMessages();

  const std::vector<Detection>& detections() const { return result_.detections; }

  /// Calls `take` with each message in turn.
  template <class Take>
  void each(const Take& take) const {
    const Header header = {1'700'000'000'123'456'789, "camera"};
    const Pose& pose = result_.detections[0].pose;
    take(PoseStamped{header, pose});
    take(PoseWithCovarianceStamped{header, pose, result_.detections[0].pose_uncertainty->covariance});
    take(transforms_);
    take(AprilTagDetectionArray{header, result_.detections});
    take(Image{header, {pixels_.data(), 3, 2, 4}});
    take(CompressedImage{header, "png", pixels_});
    for (const CameraModel& camera : cameras_) take(CameraInfo{header, camera});
    take(diagnostics_);
    take(Frame{header, result_, 0x0123456789abcdef, "a.png", "docking", "marker read", "simd", 1'234'567});
  }

 private:
  FrameResult result_;
  TransformList transforms_;
  DiagnosticArray diagnostics_;
  std::vector<u8> pixels_;
  /// One for each lens that ROS has a name for.
  std::vector<CameraModel> cameras_;
};

}  // namespace berth::ros2
