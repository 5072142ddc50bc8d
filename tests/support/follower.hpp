#pragma once

#include <gtest/gtest.h>

#include <algorithm>
#include <memory>
#include <vector>

#include "berth/tracker.hpp"
#include "sim/render.hpp"
#include "support/same_detection.hpp"

namespace berth::test {

inline constexpr int kWidth = 480, kHeight = 360;
inline constexpr double kFrame_s = 1.0 / 60;

/// Markers at places (m in the camera's frame), seen straight on.
struct Place {
  int id;
  double x, y, z;
  double size_m = 0.1;
};

inline GrayImage picture(const std::vector<Place>& places) {
  sim::Scene scene;
  scene.camera = paper_camera(kWidth, kHeight);
  for (const Place& place : places) {
    sim::SceneMarker marker;
    marker.id = place.id;
    marker.size_m = place.size_m;
    marker.margin_modules = 1;
    marker.pose.t = {place.x, place.y, place.z};
    scene.markers.push_back(marker);
  }
  static const sim::Renderer renderer(scene.camera);
  return renderer.render(scene);
}

inline FrameStamp stamp(int i, double frame_s = kFrame_s) {
  FrameStamp result;
  result.sequence = static_cast<u64>(i);
  result.mid_exposure_ns = static_cast<std::int64_t>(i * frame_s * 1e9);
  result.clock = "test";
  return result;
}

/// A detector with windows, what follows markers by it, and another that sees every frame whole.
class Follower {
 public:
  explicit Follower(const TrackerConfig& tracking = {}, const DetectorConfig& wanted = {})
      : backend_(open_backend("simd")),
        whole_(*backend_, kWidth, kHeight, wanted),
        tracker(kWidth, kHeight, tracking),
        windowed_(*backend_, kWidth, kHeight, with_windows(wanted, tracking)) {}

  /// The frame as the tracker finds it; what it finds must be the whole frame's.
  const TrackedFrame& look(const GrayImage& image, const FrameStamp& stamp) {
    const TrackedFrame& tracked = tracker.look(windowed_, image.view(), stamp);
    const std::vector<Detection>& all = whole_.detect(image.view(), stamp).detections;
    for (const Detection& found : tracked.result->detections) {
      EXPECT_TRUE(std::any_of(all.begin(), all.end(), [&](const Detection& d) { return same_bits(d, found); }))
          << "frame " << stamp.sequence << ", id " << found.id;
    }
    if (tracked.whole) {
      EXPECT_EQ(tracked.result->detections.size(), all.size());
    }
    return tracked;
  }

 private:
  static DetectorConfig with_windows(DetectorConfig config, const TrackerConfig& tracking) {
    config.window_sides = tracking_window_sides(kWidth, kHeight, tracking);
    return config;
  }

  std::unique_ptr<Backend> backend_;
  Detector whole_;

 public:
  Tracker tracker;

 private:
  Detector windowed_;
};

}  // namespace berth::test
