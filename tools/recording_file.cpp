#include "recording_file.hpp"

#include <algorithm>
#include <array>
#include <opencv2/imgcodecs.hpp>

#include "as_mat.hpp"
#include "berth/error.hpp"
#include "camera/recorded_frame.hpp"
#include "frame_record.hpp"
#include "health_show.hpp"
#include "ros2/messages.hpp"

namespace berth::cli {
namespace {

constexpr std::chrono::seconds kHealthEvery{1};

constexpr const char* kCameraFrame = "camera";

}  // namespace

RecordingFile::RecordingFile(const std::string& path, RecordPictures pictures) : file_(path), pictures_(pictures) {}

void RecordingFile::begin(const RecordingSetup& setup, const DetectorConfig& config, const std::string& backend,
                          const std::optional<CameraModel>& camera, std::int64_t wall_ns) {
  config_ = config;
  backend_ = backend;
  dock_.emplace("", config_);
  file_.begin(wall_ns);
  mcap::Metadata run{kRunMetadata, setup.settings};
  run.values["version"] = BERTH_VERSION;
  run.values["backend"] = backend;
  if (camera) run.values[kCameraSetting] = recorded_camera_text(*camera);
  file_.add(run);
  for (const mcap::Attachment& file : setup.files) file_.add(file);
  if (pictures_ == RecordPictures::raw) image_ = file_.add_topic<ros2::Image>(kImageTopic);
  if (pictures_ == RecordPictures::png) {
    image_ = file_.add_topic<ros2::CompressedImage>(std::string(kImageTopic) + "/compressed");
  }
  camera_ = file_.add_topic<ros2::CameraInfo>("/berth/camera_info");
  detections_ = file_.add_topic<ros2::AprilTagDetectionArray>("/berth/detections");
  transforms_ = file_.add_topic<ros2::TransformList>("/tf");
  pose_ = file_.add_topic<ros2::PoseWithCovarianceStamped>("/berth/pose");
  frame_ = file_.add_topic<ros2::Frame>("/berth/frame");
  health_ = file_.add_topic<ros2::DiagnosticArray>("/diagnostics");
  record_ = file_.add_text_topic(kRecordTopic);
}

void RecordingFile::write_picture(View2D<const u8> image, std::int64_t stamp_ns) {
  const ros2::Header header{stamp_ns, kCameraFrame};
  if (pictures_ == RecordPictures::raw) {
    file_.send(image_, ros2::Image{header, image});
  } else {
    if (!cv::imencode(".png", as_mat(image), png_, {cv::IMWRITE_PNG_COMPRESSION, 1})) {
      throw Error("a frame cannot be encoded as PNG; record raw pictures");
    }
    file_.send(image_, ros2::CompressedImage{header, "png", png_});
  }
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
  if (!list.transforms.empty()) file_.send(transforms_, list);
  const RosDock::Seen dock = dock_->in(result);
  if (dock.pose == nullptr) return;
  const std::array<double, 36> unknown = {};
  file_.send(pose_, ros2::PoseWithCovarianceStamped{header, *dock.pose,
                                                    dock.covariance == nullptr ? unknown : *dock.covariance});
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
  file_.send(health_, array);
}

void RecordingFile::write(const QueuedFrame& frame, View2D<const u8> image, std::uint64_t dropped_pictures,
                          std::uint64_t dropped_frames) {
  const FrameStamp& stamp = frame.result.stamp;
  const std::int64_t stamp_ns = file_.stamp_of(stamp.clock, stamp.mid_exposure_ns, frame.came_ns);
  file_.set_times(frame.came_ns, stamp_ns);
  const ros2::Header header{stamp_ns, kCameraFrame};
  write_health(frame, dropped_pictures, dropped_frames);
  if (image.data != nullptr) write_picture(image, stamp_ns);
  if (frame.camera) file_.send(camera_, ros2::CameraInfo{header, *frame.camera});
  file_.send(detections_, ros2::AprilTagDetectionArray{header, frame.result.detections});
  write_poses(frame.result, stamp_ns);
  const std::int64_t latency_ns = frame.is_paced ? frame.paced.laps_ns[static_cast<std::size_t>(Lap::latency)] : 0;
  file_.send(frame_, ros2::Frame{header, frame.result, frame.digest, frame.label, name_of(frame.mode), "", backend_,
                                 latency_ns});
  Json record = frame_record(frame.observed(image), config_, frame.filtered);
  if (frame.missed_frames > 0) record["missed"] = frame.missed_frames;
  // Last: a frame that has it has all that belongs to it.
  file_.send_text(record_, to_line(record));
  ++frames_;
  keep_up();
}

bool RecordingFile::cut_back() {
  frames_ = whole_frames_;
  return file_.cut_back();
}

void RecordingFile::keep_up() {
  if (!file_.end_due_chunk()) return;
  whole_frames_ = frames_;
  file_.sync_if_due();
}

std::map<std::string, std::uint64_t> RecordingFile::dropped_by_topic(std::uint64_t pictures,
                                                                     std::uint64_t frames) const {
  std::map<std::string, std::uint64_t> dropped;
  for (const std::string& topic : file_.topics()) {
    const bool is_image = image_ != 0 && topic == file_.topics()[image_ - 1U];
    const std::uint64_t count = frames + (is_image ? pictures : 0);
    if (count > 0 && topic != file_.topics()[health_ - 1U]) dropped[topic] = count;
  }
  return dropped;
}

void RecordingFile::finish(std::uint64_t dropped_pictures, std::uint64_t dropped_frames) {
  file_.end_chunk();
  whole_frames_ = frames_;
  mcap::Metadata end{kEndMetadata, {{"frames", std::to_string(frames_)}}};
  for (const auto& [topic, count] : dropped_by_topic(dropped_pictures, dropped_frames)) {
    end.values["dropped " + topic] = std::to_string(count);
  }
  file_.add(end);
  file_.finish();
}

}  // namespace berth::cli
