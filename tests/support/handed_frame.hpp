#pragma once

#include <optional>
#include <string>
#include <vector>

#include "berth/detector.hpp"
#include "berth/source.hpp"
#include "frame_observer.hpp"

namespace berth::test {

/// What a stream would hand over, numbered.
struct HandedFrame {
  explicit HandedFrame(int width = 16, int height = 8) : image(width, height) {
    result.detections.resize(2);
    for (Detection& detection : result.detections) detection.family = &family("tag36h11");
  }
  cli::ObservedFrame observed() {
    return {label, image.view(), result, 7, Mode::docking, camera, nullptr, nullptr, truth, targets, "simd", 0, {}, {}};
  }
  void number(u64 n) {
    result.stamp.sequence = n;
    image.view().at(0, 0) = static_cast<u8>(n);
  }

  std::string label = "frame";
  GrayImage image;
  FrameResult result;
  std::optional<CameraModel> camera;
  std::vector<TruthMarker> truth;
  std::vector<TruthTarget> targets;
};

}  // namespace berth::test
