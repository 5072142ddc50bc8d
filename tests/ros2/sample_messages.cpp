#include "ros2/sample_messages.hpp"

#include <numeric>

#include "quaternion.hpp"

namespace berth::ros2 {

SampleMessages::SampleMessages() {
  Detection detection;
  detection.family = &family("tag36h11");
  detection.id = 7;
  detection.hamming = 1;
  detection.margin = 40.5;
  detection.center = {50.25, 60.5};
  detection.corners = {{{40, 50}, {41, 70}, {62, 71}, {60, 51}}};
  detection.has_pose = true;
  // (0.5, -0.5, 0.1, 0.7) is of length 1.
  detection.pose.R = rotation_of({0.7, 0.5, -0.5, 0.1});
  detection.pose.t = {0.25, -0.5, 2};
  detection.pose_uncertainty.emplace();
  auto& covariance = detection.pose_uncertainty->covariance;
  std::iota(covariance.begin(), covariance.end(), 1.0);
  result_.detections.push_back(detection);
  detection.family = &family("aruco4x4_50");
  detection.id = 49;
  result_.detections.push_back(detection);

  result_.status = FrameStatus::ok;
  result_.stamp.sequence = 18'000'000'000'000'000'000u;
  result_.stamp.clock = "monotonic";
  result_.stamp.exposure_start_ns = 5'000'000'000;
  result_.stamp.mid_exposure_ns = 5'000'500'000;
  result_.stamp.arrival_ns = 5'003'000'000;
  result_.quads = 12;
  result_.times[0] = {"device", 800'000};
  result_.times[1] = {"decode", 70'000};
  result_.digests = {{"threshold", 0xfedcba9876543210}, {"contours", 1}};

  transforms_.transforms = {{{1'500'000'000, "camera"}, "tag36h11:7", detection.pose},
                            {{1'500'000'000, "camera"}, "dock", detection.pose}};
  diagnostics_.header = {2'000'000'001, ""};
  diagnostics_.status = {
      {Level::warn, "berth: camera", "12 frames dropped", "v4l2:video0", {{"dropped", "12"}, {"fps", "70.5"}}},
      {Level::ok, "berth: detector", "", "simd", {}}};
  pixels_ = {1, 2, 3, 99, 4, 5, 6, 99};
  cameras_.assign(3, paper_camera());
  cameras_[1].distortion[7] = 0.25;
  cameras_[2].lens = LensModel::equidistant;
}

}  // namespace berth::ros2
