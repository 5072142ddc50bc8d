#include "ros2/messages.hpp"

#include <algorithm>

#include "quaternion.hpp"
#include "target/lens_name.hpp"
#include "target/quad_map.hpp"

namespace berth::ros2 {
namespace {

void put(const Header& header, CdrWriter& cdr) {
  constexpr std::int64_t kSecond = 1'000'000'000;
  const std::int64_t ns = std::max<std::int64_t>(header.stamp_ns, 0);
  cdr.int32(static_cast<s32>(ns / kSecond));
  cdr.uint32(static_cast<u32>(ns % kSecond));
  cdr.string(header.frame_id);
}

// geometry_msgs/Pose and geometry_msgs/Transform are the same bytes.
void put(const Pose& pose, CdrWriter& cdr) {
  cdr.float64s(pose.t);
  const Quaternion q = quaternion_of(pose.R);
  for (const std::size_t i : {1, 2, 3, 0}) cdr.float64(q[i]);
}

std::array<double, 9> homography_of(const Detection& detection) {
  const auto& c = detection.corners;
  QuadMap map;
  // Clockwise from the upper left, as the map wants them; a square of two units.
  if (!map.set({c[0], c[3], c[2], c[1]}, 2, 0)) return {};
  const double w = map.gz + map.hz + 1;
  return {map.ax / w, map.bx / w, (map.ax + map.bx + map.cx) / w,  //
          map.ay / w, map.by / w, (map.ay + map.by + map.cy) / w,  //
          map.gz / w, map.hz / w, 1};
}

void put(const Detection& detection, CdrWriter& cdr) {
  cdr.string(detection.family->name);
  cdr.int32(detection.id);
  cdr.int32(detection.hamming);
  cdr.float32(0);  // `goodness`: libapriltag has given it up
  cdr.float32(static_cast<float>(detection.margin));
  cdr.float64s(detection.center);
  for (const std::size_t i : {1, 2, 3, 0}) cdr.float64s(detection.corners[i]);
  cdr.float64s(homography_of(detection));
}

void put(const DiagnosticStatus& status, CdrWriter& cdr) {
  cdr.uint8(static_cast<u8>(status.level));
  cdr.string(status.name);
  cdr.string(status.message);
  cdr.string(status.hardware_id);
  cdr.length(status.values.size());
  for (const KeyValue& value : status.values) {
    cdr.string(value.key);
    cdr.string(value.value);
  }
}

}  // namespace

void write(const PoseStamped& message, CdrWriter& cdr) {
  cdr.begin();
  put(message.header, cdr);
  put(message.pose, cdr);
}

void write(const PoseWithCovarianceStamped& message, CdrWriter& cdr) {
  cdr.begin();
  put(message.header, cdr);
  put(message.pose, cdr);
  cdr.float64s(message.covariance);
}

void write(const TransformList& message, CdrWriter& cdr) {
  cdr.begin();
  cdr.length(message.transforms.size());
  for (const TransformStamped& transform : message.transforms) {
    put(transform.header, cdr);
    cdr.string(transform.child_frame_id);
    put(transform.pose, cdr);
  }
}

void write(const AprilTagDetectionArray& message, CdrWriter& cdr) {
  cdr.begin();
  put(message.header, cdr);
  cdr.length(message.detections.size());
  for (const Detection& detection : message.detections) put(detection, cdr);
}

void write(const Image& message, CdrWriter& cdr) {
  const View2D<const u8>& pixels = message.pixels;
  const auto width = static_cast<std::size_t>(pixels.width);
  cdr.begin();
  put(message.header, cdr);
  cdr.uint32(static_cast<u32>(pixels.height));
  cdr.uint32(static_cast<u32>(pixels.width));
  cdr.string("mono8");
  cdr.uint8(0);  // is_bigendian
  cdr.uint32(static_cast<u32>(width));
  cdr.length(width * static_cast<std::size_t>(pixels.height));
  for (int y = 0; y < pixels.height; ++y) cdr.octets(pixels.row(y), width);
}

void write(const CompressedImage& message, CdrWriter& cdr) {
  cdr.begin();
  put(message.header, cdr);
  cdr.string(message.format);
  cdr.length(message.file.size());
  cdr.octets(message.file.data(), message.file.size());
}

void write(const CameraInfo& message, CdrWriter& cdr) {
  const CameraModel& c = message.camera;
  const LensName lens = lens_name_of(c);
  cdr.begin();
  put(message.header, cdr);
  cdr.uint32(static_cast<u32>(c.height));
  cdr.uint32(static_cast<u32>(c.width));
  cdr.string(lens.model);
  cdr.length(lens.coefficients);
  for (std::size_t i = 0; i < lens.coefficients; ++i) cdr.float64(c.distortion[i]);
  cdr.float64s(Mat3{c.fx, 0, c.cx, 0, c.fy, c.cy, 0, 0, 1});
  cdr.float64s(Mat3{1, 0, 0, 0, 1, 0, 0, 0, 1});
  cdr.float64s(std::array<double, 12>{c.fx, 0, c.cx, 0, 0, c.fy, c.cy, 0, 0, 0, 1, 0});
  for (int i = 0; i < 6; ++i) cdr.uint32(0);  // binning; no region of interest
  cdr.boolean(false);
}

void write(const DiagnosticArray& message, CdrWriter& cdr) {
  cdr.begin();
  put(message.header, cdr);
  cdr.length(message.status.size());
  for (const DiagnosticStatus& status : message.status) put(status, cdr);
}

void write(const Frame& message, CdrWriter& cdr) {
  const FrameResult& result = message.result;
  cdr.begin();
  put(message.header, cdr);
  cdr.uint64(result.stamp.sequence);
  cdr.uint64(message.digest);
  cdr.string(message.label);
  cdr.string(result.stamp.clock);
  cdr.int64(result.stamp.exposure_start_ns);
  cdr.int64(result.stamp.mid_exposure_ns);
  cdr.int64(result.stamp.arrival_ns);
  cdr.string(name_of(result.status));
  cdr.string(message.mode);
  cdr.string(message.change);
  cdr.string(message.backend);
  cdr.int64(message.latency_ns);
  cdr.uint32(static_cast<u32>(result.quads));
  const auto timed = std::count_if(result.times.begin(), result.times.end(),
                                   [](const StageTime& time) { return time.stage[0] != '\0'; });
  cdr.length(static_cast<std::size_t>(timed));
  for (const StageTime& time : result.times) {
    if (time.stage[0] == '\0') continue;
    cdr.string(time.stage);
    cdr.int64(time.ns);
  }
  cdr.length(result.digests.size());
  for (const StageDigest& digest : result.digests) {
    cdr.string(digest.stage);
    cdr.uint64(digest.digest);
  }
}

}  // namespace berth::ros2
