// What --ros and its companions say, checked.
#include "ros_options.hpp"

#include <algorithm>
#include <cstdlib>
#include <optional>
#include <sstream>

#include "berth/error.hpp"
#include "moment_publisher.hpp"
#include "mount.hpp"

namespace berth::cli {
namespace {

struct Known {
  const char* name;
  const char* type;
  const char* topic;
  bool latched;
  int depth;
};
// Names, latching and depths as ROS 2 has them: tf2_ros' broadcasters, image_transport, diagnostic_updater; the first
// two as apriltag_ros' and Nav2's readers look for them.
constexpr std::array<Known, kRosTopics> kKnown = {{
    {"pose", "geometry_msgs/msg/PoseWithCovarianceStamped", "pose", false, 10},
    {"detected_dock_pose", "geometry_msgs/msg/PoseStamped", "detected_dock_pose", false, 10},
    {"tf", "tf2_msgs/msg/TFMessage", "tf", false, 100},
    {"tf_static", "tf2_msgs/msg/TFMessage", "tf_static", true, 1},
    {"detections", "apriltag_msgs/msg/AprilTagDetectionArray", "detections", false, 10},
    {"camera_info", "sensor_msgs/msg/CameraInfo", "camera_info", true, 1},
    {"image", "sensor_msgs/msg/CompressedImage", "image_raw/compressed", false, 10},
    {"diagnostics", "diagnostic_msgs/msg/DiagnosticArray", "diagnostics", false, 10},
}};
constexpr int kMostDomain = 232, kMostDepth = 100'000;
constexpr const char* kGroup = "With --ros";

[[noreturn]] void refuse(const std::string& option, const std::string& value, const std::string& problem,
                         const std::string& remedy) {
  throw Error(option + " " + value + ": " + problem + "; " + remedy);
}

std::vector<std::string> split(const std::string& text, char at) {
  std::vector<std::string> parts;
  std::istringstream stream(text);
  for (std::string part; std::getline(stream, part, at);) parts.push_back(part);
  if (!text.empty() && text.back() == at) parts.emplace_back();
  return parts;
}

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_word(const std::string& word) {
  return !word.empty() && is_letter(word.front()) &&
         std::all_of(word.begin(), word.end(), [](char c) { return is_letter(c) || (c >= '0' && c <= '9'); });
}

// A name of ROS' without its leading slash.
std::string checked_name(const std::string& option, const std::string& value, std::string name) {
  if (!name.empty() && name.front() == '/') name.erase(0, 1);
  const std::vector<std::string> words = split(name, '/');
  if (words.empty() || !std::all_of(words.begin(), words.end(), is_word)) {
    refuse(option, value, "\"" + name + "\" is no name in ROS 2",
           "letters, digits and _, words parted by /, none beginning with a digit");
  }
  return name;
}

std::string names(const std::vector<RosTopic>& offered) {
  std::string all;
  for (const RosTopic topic : offered) all += (all.empty() ? "" : ", ") + std::string(name_of(topic));
  return all;
}

// NAME=VALUE; the value, and which of the topics offered is named.
std::string value_for(const char* option, const std::string& text, const std::vector<RosTopic>& offered,
                      std::size_t& topic) {
  const std::size_t at = text.find('=');
  const std::string name = text.substr(0, at);
  const auto found = std::find_if(offered.begin(), offered.end(), [&](RosTopic one) { return name == name_of(one); });
  if (at == std::string::npos || found == offered.end()) {
    refuse(option, text, "\"" + name + "\" is none of the topics", "give NAME=… with one of " + names(offered));
  }
  topic = static_cast<std::size_t>(*found);
  return text.substr(at + 1);
}

void set_topics(const RosOptions& options, RosPlan& plan) {
  std::array<std::string, kRosTopics> topics;
  topics.fill("off");
  for (const RosTopic topic : options.offered) {
    const auto i = static_cast<std::size_t>(topic);
    topics[i] = kKnown[i].topic;
  }
  for (const std::string& text : options.topics) {
    std::size_t i = 0;
    const std::string name = value_for("--ros-topic", text, options.offered, i);
    if (name != "off") checked_name("--ros-topic", text, name);
    topics[i] = name;
  }
  std::string space;
  if (!options.name_space.empty()) {
    space = checked_name("--ros-namespace", options.name_space, options.name_space) + "/";
  }
  for (std::size_t i = 0; i < kRosTopics; ++i) {
    RosTopicPlan& topic = plan.topics[i];
    topic.latched = kKnown[i].latched;
    topic.depth = kKnown[i].depth;
    if (topics[i] == "off") continue;
    topic.name = topics[i].front() == '/' ? topics[i].substr(1) : space + topics[i];
  }
  if (options.images.empty()) plan.topics[static_cast<std::size_t>(RosTopic::image)].name.clear();
  // Without a mount there is nothing that stands still.
  if (options.mount.empty()) plan.topics[static_cast<std::size_t>(RosTopic::tf_static)].name.clear();
}

void set_policy(const std::string& text, const std::string& policy, RosTopicPlan& topic) {
  if (policy == "reliable" || policy == "best_effort") {
    topic.reliable = policy == "reliable";
  } else if (policy == "volatile" || policy == "transient_local") {
    topic.latched = policy == "transient_local";
  } else {
    char* end = nullptr;
    const long depth = std::strtol(policy.c_str(), &end, 10);
    if (policy.empty() || *end != '\0' || depth < 1 || depth > kMostDepth) {
      refuse("--ros-qos", text, "\"" + policy + "\" is no policy",
             "give reliable or best_effort, volatile or transient_local, and how many messages are kept (1 to " +
                 std::to_string(kMostDepth) + "), parted by commas");
    }
    topic.depth = static_cast<int>(depth);
  }
}

void set_mount(const std::string& text, RosPlan& plan) {
  if (text.empty()) return;
  const std::size_t comma = text.find(',');
  const std::optional<Mount> mount = comma == std::string::npos ? std::nullopt : read_mount(text.substr(comma + 1));
  if (!mount) {
    refuse("--ros-mount", text, "not a frame and six numbers",
           "give PARENT,X,Y,Z,ROLL,PITCH,YAW in metres and degrees, e.g. base_link,0.2,0,0.3,0,0,0");
  }
  plan.parent = checked_frame("--ros-mount", text.substr(0, comma));
  plan.mount = mounted_camera(*mount);
}

int domain_of(const RosOptions& options) {
  const char* const given = std::getenv("ROS_DOMAIN_ID");
  if (options.domain >= 0 || given == nullptr || given[0] == '\0') return std::max(options.domain, 0);
  char* end = nullptr;
  const long domain = std::strtol(given, &end, 10);
  if (*end != '\0' || domain < 0 || domain > kMostDomain) {
    refuse("ROS_DOMAIN_ID", given, "no domain", "set it to 0 … 232, or give --ros-domain");
  }
  return static_cast<int>(domain);
}

void with_ros(CLI::Option* option, CLI::Option* ros, const char* type) {
  option->type_name(type)->needs(ros)->group(kGroup);
}

}  // namespace

const char* name_of(RosTopic topic) { return kKnown[static_cast<std::size_t>(topic)].name; }
const char* type_of(RosTopic topic) { return kKnown[static_cast<std::size_t>(topic)].type; }

std::string checked_frame(const char* option, const std::string& frame) {
  if (frame.empty() || frame.front() == '/' || frame.find_first_of(" \t\n") != std::string::npos) {
    refuse(option, "\"" + frame + "\"", "no name of a frame", "give one without spaces and without / in front");
  }
  return frame;
}

CLI::Option* add_ros_network_options(CLI::App& command, RosOptions& options, const std::string& what) {
  CLI::Option* ros =
      command.add_flag("--ros", options.on, "publish to ROS 2 nodes, without ROS: " + what + " (docs/ros2.md)");
  with_ros(command.add_option("--ros-domain", options.domain, "domain [ROS_DOMAIN_ID, or 0]")
               ->check(CLI::Range(0, kMostDomain)),
           ros, "N");
  with_ros(command.add_option("--ros-namespace", options.name_space, "put before every topic's name"), ros, "NAME");
  with_ros(command
               .add_option("--ros-topic", options.topics,
                           "another name for one of " + names(options.offered) +
                               "; or off. May be repeated; /NAME stays outside the "
                               "namespace")
               ->allow_extra_args(false),
           ros, "NAME=TOPIC");
  with_ros(command
               .add_option("--ros-qos", options.qos,
                           "reliable or best_effort, volatile or transient_local, messages kept; may be repeated")
               ->allow_extra_args(false),
           ros, "NAME=POLICY,…");
  with_ros(command.add_option("--ros-frame-prefix", options.frame_prefix, "put before every frame's name"), ros,
           "TEXT");
  command.add_flag("--ros-source-time", options.source_time, "stamps are the frames' own times, whatever their clock")
      ->needs(ros)
      ->group(kGroup);
  with_ros(command
               .add_option("--ros-wait", options.wait_s,
                           "before the first frame, wait so long at most for every topic that is not transient_local "
                           "to have a reader")
               ->check(CLI::Range(0.0, 3600.0)),
           ros, "SECONDS");
  return ros;
}

void add_ros_options(CLI::App& command, RosOptions& options) {
  CLI::Option* ros = add_ros_network_options(command, options, "poses, tf, detections, camera, diagnostics");
  with_ros(command.add_option("--ros-frame", options.camera_frame, "what the camera's frame is called")
               ->capture_default_str(),
           ros, "NAME");
  with_ros(command.add_option("--ros-dock", options.dock,
                              "whose pose is published: a bundle, a target or FAMILY:ID [the first that has one]"),
           ros, "NAME");
  with_ros(command.add_option("--ros-mount", options.mount,
                              "where the camera sits, for tf_static: parent's frame, m and degrees; x forward, y left, "
                              "z up"),
           ros, "PARENT,X,Y,Z,ROLL,PITCH,YAW");
  with_ros(
      command.add_option("--ros-images", options.images, "publish images, too")->check(CLI::IsMember({"jpeg", "png"})),
      ros, "jpeg|png");
  with_ros(command.add_option("--ros-image-rate", options.image_rate, "most images a second")
               ->check(CLI::Range(0.01, 1000.0))
               ->capture_default_str(),
           ros, "HZ");
}

RosPlan make_ros_plan(const RosOptions& options) {
  RosPlan plan;
  plan.domain = domain_of(options);
  set_topics(options, plan);
  for (const std::string& text : options.qos) {
    std::size_t i = 0;
    const std::vector<std::string> policies = split(value_for("--ros-qos", text, options.offered, i), ',');
    if (policies.empty()) set_policy(text, "", plan.topics[i]);
    for (const std::string& policy : policies) set_policy(text, policy, plan.topics[i]);
  }
  plan.frame_prefix = options.frame_prefix;
  plan.camera_frame = checked_frame("--ros-frame", options.frame_prefix + options.camera_frame);
  plan.dock = options.dock;
  set_mount(options.mount, plan);
  plan.images = options.images;
  plan.image_rate = options.image_rate;
  plan.source_time = options.source_time;
  plan.wait_s = options.wait_s;
  return plan;
}

#if !BERTH_WITH_ROS2
namespace {

[[noreturn]] void refuse_ros() {
  throw Error(
      "--ros: this berth was built without Cyclone DDS; install cyclonedds-dev (0.10) and build again with "
      "-DBERTH_WITH_ROS2=ON");
}

}  // namespace

std::shared_ptr<FrameObserver> make_ros_publisher(const RosPlan&) { refuse_ros(); }
std::unique_ptr<MomentObserver> make_moment_publisher(const RosPlan&, const VehicleFrames&, double) { refuse_ros(); }
#endif

}  // namespace berth::cli
