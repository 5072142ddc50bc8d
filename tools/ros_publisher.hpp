#pragma once

#include <atomic>
#include <chrono>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "berth/detector.hpp"
#include "bounded_worker.hpp"
#include "frame_observer.hpp"
#include "ros2/messages.hpp"
#include "ros_dock.hpp"
#include "ros_health.hpp"
#include "ros_options.hpp"
#include "ros_writers.hpp"

namespace berth::cli {

/// Frames to ROS 2 nodes. The stream's thread copies a frame into a free slot and goes on; one thread makes messages of
/// it and sends them, another compresses images.
class RosPublisher final : public FrameObserver {
 public:
  /// Throws Error where the network cannot be had.
  explicit RosPublisher(RosPlan plan);

  void begin(const ObservedStream& stream) override;
  void observe(const ObservedFrame& frame) override;
  void finish(std::ostream& people) override;

 private:
  struct Item {
    std::int64_t stamp_ns = 0, latency_ns = -1;
    FrameResult result;
    HealthReport engine;
    std::optional<CameraModel> camera;
  };
  struct ImageItem {
    std::int64_t stamp_ns = 0;
    int width = 0, height = 0;
    std::vector<u8> pixels;
  };
  void offer_image(const ObservedFrame& frame, std::int64_t stamp_ns);
  std::string_view frame_of(const MarkerFamily& family, int id);
  void add_transform(const ros2::Header& header, std::string_view child, const Pose& pose);

  // On the publisher's threads.
  void publish(const Item& item);
  void publish_image(const ImageItem& item);
  void publish_health();

  RosPlan plan_;
  RosWriters writers_;
  /// Frames that found the queue full.
  std::atomic<std::uint64_t> unpublished_ = 0;
  std::unique_ptr<RosDock> dock_;
  std::unique_ptr<RosHealth> health_;
  std::chrono::steady_clock::time_point reported_;
  std::chrono::steady_clock::time_point next_image_;
  ros2::TransformList transforms_;
  /// Names of frames: of bundles, then of targets; and of the markers seen so far.
  std::vector<std::string> bundle_frames_, target_frames_;
  std::map<std::pair<const MarkerFamily*, int>, std::string> marker_frames_;
  RosSender results_, images_;
  std::int64_t cpu_ns_ = 0;  // of the thread that sends results
  std::unique_ptr<BoundedWorker<Item>> worker_;
  std::unique_ptr<BoundedWorker<ImageItem>> image_worker_;
};

}  // namespace berth::cli
