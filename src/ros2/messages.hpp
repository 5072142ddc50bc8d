#pragma once

#include <array>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "berth/camera.hpp"
#include "berth/frame.hpp"
#include "berth/image.hpp"
#include "berth/marker.hpp"
#include "ros2/cdr.hpp"

/// Berth's results as ROS 2 messages (docs/ros2.md), for whatever sends or records them. A struct here borrows what it
/// is made of; `write` makes a whole message of it, byte for byte what ROS 2 itself would send, and allocates only
/// where the writer has never held one as long. Poses and axes are Berth's (docs/coordinate-frames.md), unchanged.
namespace berth::ros2 {

/// Names the sort of message as recordings do: "geometry_msgs/msg/PoseStamped".
#define BERTH_ROS2_TYPE(package, name) static constexpr const char* kType = #package "/msg/" #name

/// std_msgs/Header.
struct Header {
  /// builtin_interfaces/Time, as nanoseconds since 1970. From 0 to 2^31 seconds; earlier counts as 0.
  std::int64_t stamp_ns = 0;
  std::string_view frame_id;
};

struct PoseStamped {
  BERTH_ROS2_TYPE(geometry_msgs, PoseStamped);
  Header header;
  Pose pose;
};

/// Covariances are laid out alike: x, y, z, then turns about axes parallel to the header's frame, row-major.
struct PoseWithCovarianceStamped {
  BERTH_ROS2_TYPE(geometry_msgs, PoseWithCovarianceStamped);
  Header header;
  Pose pose;
  std::array<double, 36> covariance = {};
};

/// geometry_msgs/TransformStamped: takes points of the child frame to the header's.
struct TransformStamped {
  Header header;
  std::string_view child_frame_id;
  Pose pose;
};

struct TransformList {
  BERTH_ROS2_TYPE(tf2_msgs, TFMessage);
  std::vector<TransformStamped> transforms;
};

/// Corners go in libapriltag's order, as apriltag_ros publishes them: the upright marker's lower left first, then
/// counter-clockwise. Pixel centres lie at integers, as in CameraInfo. The homography takes (-1, -1), the upper left,
/// to (1, 1), the lower right, to pixels; its last element is 1.
struct AprilTagDetectionArray {
  BERTH_ROS2_TYPE(apriltag_msgs, AprilTagDetectionArray);
  Header header;
  const std::vector<Detection>& detections;
};

/// A gray image, `mono8`, whose rows follow each other without gaps.
struct Image {
  BERTH_ROS2_TYPE(sensor_msgs, Image);
  Header header;
  View2D<const u8> pixels;
};

struct CompressedImage {
  BERTH_ROS2_TYPE(sensor_msgs, CompressedImage);
  Header header;
  /// "jpeg" or "png"
  std::string_view format;
  const std::vector<u8>& file;
};

/// plumb_bob, rational_polynomial or equidistant. Images are as the camera took them: R is the identity, P is K.
struct CameraInfo {
  BERTH_ROS2_TYPE(sensor_msgs, CameraInfo);
  Header header;
  const CameraModel& camera;
};

enum class Level : u8 { ok = 0, warn = 1, error = 2, stale = 3 };

struct KeyValue {
  std::string_view key;
  std::string value;
};

/// diagnostic_msgs/DiagnosticStatus.
struct DiagnosticStatus {
  Level level = Level::ok;
  std::string_view name, message, hardware_id;
  std::vector<KeyValue> values;
};

struct DiagnosticArray {
  BERTH_ROS2_TYPE(diagnostic_msgs, DiagnosticArray);
  Header header;
  std::vector<DiagnosticStatus> status;
};

/// What a frame was and came to, beside what was seen in it. The message is Berth's own.
struct Frame {
  BERTH_ROS2_TYPE(berth_msgs, Frame);
  Header header;
  const FrameResult& result;
  /// Of all that was found in it, bit for bit: what a replay has to come to again.
  u64 digest = 0;
  /// File name, or the source's own name for it.
  std::string_view label;
  /// "search", "navigation" or "docking", and why it changed in this frame; empty where nothing did.
  std::string_view mode, change;
  std::string_view backend;
  /// From mid-exposure to the result where the clocks tell, else from arrival, ns.
  std::int64_t latency_ns = 0;
};

#undef BERTH_ROS2_TYPE

void write(const PoseStamped& message, CdrWriter& cdr);
void write(const PoseWithCovarianceStamped& message, CdrWriter& cdr);
void write(const TransformList& message, CdrWriter& cdr);
void write(const AprilTagDetectionArray& message, CdrWriter& cdr);
void write(const Image& message, CdrWriter& cdr);
void write(const CompressedImage& message, CdrWriter& cdr);
void write(const CameraInfo& message, CdrWriter& cdr);
void write(const DiagnosticArray& message, CdrWriter& cdr);
void write(const Frame& message, CdrWriter& cdr);

/// Every kType above.
const std::vector<std::string>& message_types();

/// The definition of a type and, behind lines of `=`, of all that it is made of: a recording's schema of the encoding
/// "ros2msg". Throws Error on a type that message_types() does not have.
std::string schema_of(std::string_view type);

/// "geometry_msgs/msg/PoseStamped" as DDS calls it: "geometry_msgs::msg::dds_::PoseStamped_".
std::string dds_name_of(std::string_view type);

}  // namespace berth::ros2
