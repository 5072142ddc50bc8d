#include "recording_file.hpp"

#include <algorithm>
#include <array>
#include <opencv2/imgcodecs.hpp>
#include <string_view>

#include "as_mat.hpp"
#include "berth/error.hpp"
#include "camera/recorded_frame.hpp"
#include "frame_record.hpp"
#include "health_show.hpp"
#include "monotonic.hpp"
#include "ros2/messages.hpp"

namespace berth::cli {
namespace {

/// A chunk ends with the frame that fills it so far, or so long after its first; then the disk is waited for, at most
/// so often: what a loss of power costs.
constexpr std::size_t kChunkBytes = std::size_t{1} << 20;
constexpr std::chrono::seconds kChunkAge{1}, kSyncEvery{1};
constexpr std::chrono::seconds kHealthEvery{1};

constexpr const char* kCameraFrame = "camera";

}  // namespace

RecordingFile::RecordingFile(const std::string& path, RecordPictures pictures)
    : writer_(path, "ros2", "berth " BERTH_VERSION), pictures_(pictures), synced_(Clock::now()) {}

mcap::u16 RecordingFile::add_topic(const std::string& topic, const std::string& type, const std::string& schema) {
  const mcap::u16 id = static_cast<mcap::u16>(topics_.size() + 1);
  writer_.add(mcap::Schema{id, type, "ros2msg", schema});
  writer_.add(mcap::Channel{id, id, topic, "cdr", {}});
  topics_.push_back(topic);
  sequences_.push_back(0);
  return id;
}

void RecordingFile::begin(const RecordingSetup& setup, const DetectorConfig& config, const std::string& backend,
                          const std::optional<CameraModel>& camera, std::int64_t wall_ns) {
  config_ = config;
  backend_ = backend;
  dock_.emplace("", config_);
  start_wall_ns_ = wall_ns;
  start_monotonic_ns_ = monotonic_ns();
  mcap::Metadata run{kRunMetadata, setup.settings};
  run.values["version"] = BERTH_VERSION;
  run.values["backend"] = backend;
  if (camera) run.values[kCameraSetting] = recorded_camera_text(*camera);
  writer_.add(run);
  for (const mcap::Attachment& file : setup.files) writer_.add(file, static_cast<u64>(wall_ns));
  const auto add = [&](const std::string& topic, const char* type) {
    return add_topic(topic, type, ros2::schema_of(type));
  };
  if (pictures_ == RecordPictures::raw) image_ = add(kImageTopic, ros2::Image::kType);
  if (pictures_ == RecordPictures::png)
    image_ = add(std::string(kImageTopic) + "/compressed", ros2::CompressedImage::kType);
  camera_ = add("/berth/camera_info", ros2::CameraInfo::kType);
  detections_ = add("/berth/detections", ros2::AprilTagDetectionArray::kType);
  transforms_ = add("/tf", ros2::TransformList::kType);
  pose_ = add("/berth/pose", ros2::PoseWithCovarianceStamped::kType);
  frame_ = add("/berth/frame", ros2::Frame::kType);
  health_ = add("/diagnostics", ros2::DiagnosticArray::kType);
  record_ = add_topic(kRecordTopic, "std_msgs/msg/String", "string data\n");
}

void RecordingFile::send(mcap::u16 topic) {
  const std::vector<u8>& bytes = cdr_.bytes();
  if (writer_.waiting() == 0) chunk_began_ = Clock::now();
  writer_.write({topic, sequences_[topic - 1U]++, log_time_, stamp_time_, bytes.data(), bytes.size()});
}

/// The frame's own time as nanoseconds since 1970. The monotonic clock is carried over as it stood at the start; others
/// count from the first frame on, which gets the time at which it came; frames without a time are as old as that.
std::int64_t RecordingFile::stamp_of(const QueuedFrame& frame) {
  const FrameStamp& stamp = frame.result.stamp;
  const std::string_view clock = stamp.clock;
  if (clock == "none") return frame.came_ns;
  if (clock == "monotonic") return start_wall_ns_ + (stamp.mid_exposure_ns - start_monotonic_ns_);
  if (!has_first_) first_ns_ = stamp.mid_exposure_ns - frame.came_ns;
  has_first_ = true;
  return stamp.mid_exposure_ns - first_ns_;
}

void RecordingFile::write_picture(View2D<const u8> image, std::int64_t stamp_ns) {
  const ros2::Header header{stamp_ns, kCameraFrame};
  if (pictures_ == RecordPictures::raw) {
    ros2::write(ros2::Image{header, image}, cdr_);
  } else {
    if (!cv::imencode(".png", as_mat(image), png_, {cv::IMWRITE_PNG_COMPRESSION, 1})) {
      throw Error("a frame cannot be encoded as PNG; record raw pictures");
    }
    ros2::write(ros2::CompressedImage{header, "png", png_}, cdr_);
  }
  send(image_);
}

/// Every pose as a transform, and that of the dock.
void RecordingFile::write_poses(const FrameResult& result, std::int64_t stamp_ns) {
  const ros2::Header header{stamp_ns, kCameraFrame};
  std::vector<std::string> names;
  names.reserve(result.detections.size());
  ros2::TransformList list;
  for (std::size_t i = 0; i < result.bundles.size(); ++i) {
    const BundlePose& bundle = result.bundles[i];
    if (bundle.has_pose) list.transforms.push_back({header, config_.bundles[i].name, bundle.pose});
  }
  for (std::size_t i = 0; i < result.disc_targets.size(); ++i) {
    const DiscPose& target = result.disc_targets[i];
    if (target.has_pose) list.transforms.push_back({header, config_.disc_targets[i].name, target.pose});
  }
  for (const Detection& detection : result.detections) {
    if (!detection.has_pose) continue;
    names.push_back(detection.family->name + ":" + std::to_string(detection.id));
    list.transforms.push_back({header, names.back(), detection.pose});
  }
  if (!list.transforms.empty()) {
    ros2::write(list, cdr_);
    send(transforms_);
  }
  const RosDock::Seen dock = dock_->in(result);
  if (dock.pose == nullptr) return;
  const std::array<double, 36> unknown = {};
  ros2::write(
      ros2::PoseWithCovarianceStamped{header, *dock.pose, dock.covariance == nullptr ? unknown : *dock.covariance},
      cdr_);
  send(pose_);
}

void RecordingFile::write_health(const QueuedFrame& frame, std::uint64_t dropped_pictures,
                                 std::uint64_t dropped_frames) {
  // Not by when the frame came: that is the wall clock's, which may be set back by an hour.
  const Clock::time_point now = Clock::now();
  if (now < next_health_) return;
  next_health_ = now + kHealthEvery;
  const auto number = [](const char* key, std::uint64_t value) { return ros2::KeyValue{key, std::to_string(value)}; };
  const bool dropping = dropped_pictures + dropped_frames > 0;
  const SourceHealth& health = frame.health;
  const bool lossy = health.lost + health.incomplete + health.repeated + health.misdated + health.reopened > 0;
  ros2::DiagnosticArray array{{frame.came_ns, ""}, {}};
  array.status.push_back({dropping ? ros2::Level::warn : ros2::Level::ok,
                          "berth: recorder",
                          dropping ? "the disk does not keep up" : "everything is recorded",
                          "",
                          {number("frames", frames_), number("dropped_frames", dropped_frames),
                           number("dropped_pictures", dropped_pictures)}});
  array.status.push_back({lossy ? ros2::Level::warn : ros2::Level::ok,
                          "berth: source",
                          lossy ? "frames are missing" : "nothing is missing",
                          "",
                          {number("lost", health.lost), number("incomplete", health.incomplete),
                           number("skipped", health.skipped), number("repeated", health.repeated),
                           number("misdated", health.misdated), number("reopened", health.reopened)}});
  const HealthMode mode = mode_of(frame.engine, frame.result.status);
  array.status.push_back({mode == HealthMode::failed    ? ros2::Level::error
                          : mode == HealthMode::nominal ? ros2::Level::ok
                                                        : ros2::Level::warn,
                          "berth: engine",
                          name_of(frame.result.status),
                          backend_,
                          {{"mode", name_of(mode)},
                           {"reason", frame.engine.reason},
                           number("known_answers", frame.engine.known_answers),
                           number("wrong_answers", frame.engine.wrong_answers),
                           number("checked_bytes", frame.engine.checked_bytes),
                           number("alterations", frame.engine.alterations),
                           number("tries", frame.engine.tries),
                           number("returns", frame.engine.returns),
                           {"recovery", frame.engine.recovery}}});
  ros2::write(array, cdr_);
  send(health_);
}

void RecordingFile::write(const QueuedFrame& frame, View2D<const u8> image, std::uint64_t dropped_pictures,
                          std::uint64_t dropped_frames) {
  const std::int64_t stamp_ns = stamp_of(frame);
  log_time_ = static_cast<u64>(std::max<std::int64_t>(frame.came_ns, 0));
  stamp_time_ = static_cast<u64>(std::max<std::int64_t>(stamp_ns, 0));
  const ros2::Header header{stamp_ns, kCameraFrame};
  write_health(frame, dropped_pictures, dropped_frames);
  if (image.data != nullptr) write_picture(image, stamp_ns);
  if (frame.camera) {
    ros2::write(ros2::CameraInfo{header, *frame.camera}, cdr_);
    send(camera_);
  }
  ros2::write(ros2::AprilTagDetectionArray{header, frame.result.detections}, cdr_);
  send(detections_);
  write_poses(frame.result, stamp_ns);
  const std::int64_t latency_ns = frame.is_paced ? frame.paced.laps_ns[static_cast<std::size_t>(Lap::latency)] : 0;
  ros2::write(
      ros2::Frame{header, frame.result, frame.digest, frame.label, name_of(frame.mode), "", backend_, latency_ns},
      cdr_);
  send(frame_);
  Json record = frame_record(frame.observed(image), config_, frame.filtered);
  if (frame.missed_frames > 0) record["missed"] = frame.missed_frames;
  cdr_.begin();
  cdr_.string(to_line(record));
  // Last: a frame that has it has all that belongs to it.
  send(record_);
  ++frames_;
  keep_up();
}

void RecordingFile::end_chunk() {
  writer_.end_chunk();
  whole_frames_ = frames_;
}

bool RecordingFile::cut_back() {
  frames_ = whole_frames_;
  return writer_.cut_back();
}

void RecordingFile::keep_up() {
  const Clock::time_point now = Clock::now();
  if (writer_.waiting() == 0 || (writer_.waiting() < kChunkBytes && now - chunk_began_ < kChunkAge)) return;
  end_chunk();
  if (now - synced_ < kSyncEvery) return;
  writer_.sync();
  synced_ = Clock::now();
}

std::map<std::string, std::uint64_t> RecordingFile::dropped_by_topic(std::uint64_t pictures,
                                                                     std::uint64_t frames) const {
  std::map<std::string, std::uint64_t> dropped;
  for (const std::string& topic : topics_) {
    const bool is_image = image_ != 0 && topic == topics_[image_ - 1U];
    const std::uint64_t count = frames + (is_image ? pictures : 0);
    if (count > 0 && topic != topics_[health_ - 1U]) dropped[topic] = count;
  }
  return dropped;
}

void RecordingFile::finish(std::uint64_t dropped_pictures, std::uint64_t dropped_frames) {
  end_chunk();
  mcap::Metadata end{kEndMetadata, {{"frames", std::to_string(frames_)}}};
  for (const auto& [topic, count] : dropped_by_topic(dropped_pictures, dropped_frames)) {
    end.values["dropped " + topic] = std::to_string(count);
  }
  writer_.add(end);
  writer_.finish();
}

}  // namespace berth::cli
