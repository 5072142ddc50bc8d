// Definitions of the messages, as ROS 2's packages have them without their comments; berth_msgs is Berth's own.

#include <algorithm>
#include <array>

#include "berth/error.hpp"
#include "ros2/messages.hpp"

namespace berth::ros2 {
namespace {

struct Definition {
  const char* type;
  const char* text;
};

// What is made of others stands before them.
constexpr std::array kDefinitions = {
    Definition{"geometry_msgs/msg/PoseStamped", "std_msgs/Header header\ngeometry_msgs/Pose pose\n"},
    Definition{"geometry_msgs/msg/PoseWithCovarianceStamped",
               "std_msgs/Header header\ngeometry_msgs/PoseWithCovariance pose\n"},
    Definition{"tf2_msgs/msg/TFMessage", "geometry_msgs/TransformStamped[] transforms\n"},
    Definition{"apriltag_msgs/msg/AprilTagDetectionArray",
               "std_msgs/Header header\napriltag_msgs/AprilTagDetection[] detections\n"},
    Definition{"sensor_msgs/msg/Image",
               "std_msgs/Header header\nuint32 height\nuint32 width\nstring encoding\nuint8 is_bigendian\nuint32 step\n"
               "uint8[] data\n"},
    Definition{"sensor_msgs/msg/CompressedImage", "std_msgs/Header header\nstring format\nuint8[] data\n"},
    Definition{"sensor_msgs/msg/CameraInfo",
               "std_msgs/Header header\nuint32 height\nuint32 width\nstring distortion_model\nfloat64[] d\n"
               "float64[9] k\nfloat64[9] r\nfloat64[12] p\nuint32 binning_x\nuint32 binning_y\n"
               "sensor_msgs/RegionOfInterest roi\n"},
    Definition{"diagnostic_msgs/msg/DiagnosticArray",
               "std_msgs/Header header\ndiagnostic_msgs/DiagnosticStatus[] status\n"},
    Definition{"berth_msgs/msg/Frame",
               "std_msgs/Header header\n"
               "uint64 sequence\n"
               "uint64 digest\n"
               "string label\n"
               "string clock\n"
               "int64 exposure_start_ns\n"
               "int64 mid_exposure_ns\n"
               "int64 arrival_ns\n"
               "string status\n"
               "string mode\n"
               "string change\n"
               "string backend\n"
               "int64 latency_ns\n"
               "uint32 quads\n"
               "berth_msgs/StageTime[] times\n"
               "berth_msgs/StageDigest[] digests\n"},
    Definition{"geometry_msgs/msg/PoseWithCovariance", "geometry_msgs/Pose pose\nfloat64[36] covariance\n"},
    Definition{"geometry_msgs/msg/Pose", "geometry_msgs/Point position\ngeometry_msgs/Quaternion orientation\n"},
    Definition{"geometry_msgs/msg/Point", "float64 x\nfloat64 y\nfloat64 z\n"},
    Definition{"geometry_msgs/msg/TransformStamped",
               "std_msgs/Header header\nstring child_frame_id\ngeometry_msgs/Transform transform\n"},
    Definition{"geometry_msgs/msg/Transform", "geometry_msgs/Vector3 translation\ngeometry_msgs/Quaternion rotation\n"},
    Definition{"geometry_msgs/msg/Vector3", "float64 x\nfloat64 y\nfloat64 z\n"},
    Definition{"geometry_msgs/msg/Quaternion", "float64 x 0\nfloat64 y 0\nfloat64 z 0\nfloat64 w 1\n"},
    Definition{"apriltag_msgs/msg/AprilTagDetection",
               "string family\nint32 id\nint32 hamming\nfloat32 goodness\nfloat32 decision_margin\n"
               "apriltag_msgs/Point centre\napriltag_msgs/Point[4] corners\nfloat64[9] homography\n"},
    Definition{"apriltag_msgs/msg/Point", "float64 x\nfloat64 y\n"},
    Definition{"sensor_msgs/msg/RegionOfInterest",
               "uint32 x_offset\nuint32 y_offset\nuint32 height\nuint32 width\nbool do_rectify\n"},
    Definition{"diagnostic_msgs/msg/DiagnosticStatus",
               "byte OK=0\nbyte WARN=1\nbyte ERROR=2\nbyte STALE=3\nbyte level\nstring name\nstring message\n"
               "string hardware_id\ndiagnostic_msgs/KeyValue[] values\n"},
    Definition{"diagnostic_msgs/msg/KeyValue", "string key\nstring value\n"},
    Definition{"berth_msgs/msg/StageTime", "string stage\nint64 ns\n"},
    Definition{"berth_msgs/msg/StageDigest", "string stage\nuint64 digest\n"},
    Definition{"std_msgs/msg/Header", "builtin_interfaces/Time stamp\nstring frame_id\n"},
    Definition{"builtin_interfaces/msg/Time", "int32 sec\nuint32 nanosec\n"},
};
// The first so many are messages, the others parts.
constexpr std::size_t kMessages = 9;
constexpr std::string_view kFolder = "/msg/";

// "geometry_msgs/Pose", as definitions name their parts.
std::string short_name(std::string_view type) {
  const std::size_t at = type.find(kFolder);
  return std::string(type.substr(0, at)) + "/" + std::string(type.substr(at + kFolder.size()));
}

// Whether a line of the text begins with the name, or with a list of it.
bool uses(std::string_view text, const std::string& name) {
  const std::string lines = "\n" + std::string(text);
  return lines.find("\n" + name + " ") != std::string::npos || lines.find("\n" + name + "[") != std::string::npos;
}

}  // namespace

const std::vector<std::string>& message_types() {
  static const std::vector<std::string> types = [] {
    std::vector<std::string> names;
    for (std::size_t i = 0; i < kMessages; ++i) names.emplace_back(kDefinitions[i].type);
    return names;
  }();
  return types;
}

std::string schema_of(std::string_view type) {
  const std::vector<std::string>& types = message_types();
  const auto found = std::find(types.begin(), types.end(), type);
  if (found == types.end()) throw Error("\"" + std::string(type) + "\" is no message of Berth's");
  std::string schema = kDefinitions[static_cast<std::size_t>(found - types.begin())].text;
  // Parts stand behind what uses them, so one pass finds all.
  for (std::size_t i = kMessages; i < kDefinitions.size(); ++i) {
    const std::string name = short_name(kDefinitions[i].type);
    if (!uses(schema, name)) continue;
    schema += std::string(80, '=') + "\nMSG: " + name + "\n" + kDefinitions[i].text;
  }
  return schema;
}

std::string dds_name_of(std::string_view type) {
  const std::size_t at = type.find(kFolder);
  return std::string(type.substr(0, at)) + "::msg::dds_::" + std::string(type.substr(at + kFolder.size())) + "_";
}

}  // namespace berth::ros2
