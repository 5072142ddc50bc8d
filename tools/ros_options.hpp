#pragma once

#include <CLI/App.hpp>
#include <array>
#include <memory>
#include <string>
#include <vector>

#include "berth/marker.hpp"
#include "frame_observer.hpp"

namespace berth::cli {

/// What is published to ROS 2 (docs/ros2.md).
enum class RosTopic { pose, dock_pose, tf, tf_static, detections, camera_info, image, diagnostics };
constexpr std::size_t kRosTopics = 8;

/// As typed.
struct RosOptions {
  bool on = false;
  /// What there is to publish; the caller's.
  std::vector<RosTopic> offered = {RosTopic::pose,       RosTopic::dock_pose,   RosTopic::tf,    RosTopic::tf_static,
                                   RosTopic::detections, RosTopic::camera_info, RosTopic::image, RosTopic::diagnostics};
  /// Below 0: ROS_DOMAIN_ID, or 0 without it.
  int domain = -1;
  std::string name_space;
  /// NAME=TOPIC and NAME=QOS.
  std::vector<std::string> topics, qos;
  std::string camera_frame = "camera_optical_frame";
  std::string frame_prefix;
  /// The bundle, target or FAMILY:ID that the poses are of; empty for the first there is.
  std::string dock;
  /// PARENT,X,Y,Z,ROLL,PITCH,YAW
  std::string mount;
  /// "jpeg", "png" or empty.
  std::string images;
  double image_rate = 5;
  /// Stamps are the source's own times, whatever their clock.
  bool source_time = false;
  double wait_s = 0;
};

/// A topic as it is to be published.
struct RosTopicPlan {
  /// Without the leading slash; empty where it is not to be.
  std::string name;
  bool reliable = true, latched = false;
  int depth = 10;
};

/// The options, checked.
struct RosPlan {
  int domain = 0;
  std::array<RosTopicPlan, kRosTopics> topics;
  /// With the prefix.
  std::string camera_frame;
  std::string frame_prefix;
  std::string dock;
  /// Of the static transform from `parent` to the camera's frame; none where `parent` is empty.
  std::string parent;
  Pose mount;
  std::string images;
  double image_rate = 0;
  bool source_time = false;
  double wait_s = 0;

  const RosTopicPlan& topic(RosTopic topic) const { return topics[static_cast<std::size_t>(topic)]; }
};

/// How options call it, and the ROS type of its messages.
const char* name_of(RosTopic topic);
const char* type_of(RosTopic topic);

/// A name of a frame, or an Error that names the option.
std::string checked_frame(const char* option, const std::string& frame);

/// --ros, which is returned, and what goes with it whatever is published; `what` that is, in short.
CLI::Option* add_ros_network_options(CLI::App& command, RosOptions& options, const std::string& what);
/// The same and what goes with a camera's frames.
void add_ros_options(CLI::App& command, RosOptions& options);

/// Throws Error that names the option, its value and the remedy.
RosPlan make_ros_plan(const RosOptions& options);

/// Publishes every frame. Throws Error where the network cannot be had, or this build has no ROS 2 output.
std::shared_ptr<FrameObserver> make_ros_publisher(const RosPlan& plan);

}  // namespace berth::cli
