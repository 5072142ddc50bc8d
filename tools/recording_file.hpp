#pragma once

#include <chrono>
#include <cstdint>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "berth/detector.hpp"
#include "frame_queue.hpp"
#include "message_file.hpp"
#include "ros_dock.hpp"

namespace berth::cli {

/// How frames' pictures are kept.
enum class RecordPictures { raw, png, none };

/// What a recording says before its first frame, so that a replay needs nothing else (docs/recording.md).
struct RecordingSetup {
  std::map<std::string, std::string> settings;
  std::vector<mcap::Attachment> files;
};

/// The metadata record with what became of the run.
inline constexpr const char* kEndMetadata = "berth.end";

/// A run as ROS 2 messages in an MCAP file. Frames are never parted by a chunk's end.
class RecordingFile {
 public:
  /// Makes the file. Throws Error.
  RecordingFile(const std::string& path, RecordPictures pictures);

  /// Settings, files and topics. `config`: of the frames, for what is in their records; `camera`: what a source of this
  /// recording has for its own.
  void begin(const RecordingSetup& setup, const DetectorConfig& config, const std::string& backend,
             const std::optional<CameraModel>& camera, std::int64_t wall_ns);
  /// A frame in all its topics. `image` without pixels: without its picture.
  void write(const QueuedFrame& frame, View2D<const u8> image, std::uint64_t dropped_pictures,
             std::uint64_t dropped_frames);
  /// Ends the chunk and has it on the disk, where it is time for that.
  void keep_up();
  /// What was dropped, by topic, and the end of the file.
  void finish(std::uint64_t dropped_pictures, std::uint64_t dropped_frames);
  /// After an Error: what is whole stays. False when that failed, too.
  bool cut_back();

  /// Written; after cut_back, those that stayed.
  std::uint64_t frames() const { return frames_; }
  u64 bytes() const { return file_.bytes(); }
  /// How many messages of each topic were dropped, none left out that has any.
  std::map<std::string, std::uint64_t> dropped_by_topic(std::uint64_t pictures, std::uint64_t frames) const;

 private:
  using Clock = std::chrono::steady_clock;

  void write_picture(View2D<const u8> image, std::int64_t stamp_ns);
  void write_poses(const FrameResult& result, std::int64_t stamp_ns);
  void write_health(const QueuedFrame& frame, std::uint64_t dropped_pictures, std::uint64_t dropped_frames);

  MessageFile file_;
  RecordPictures pictures_;
  DetectorConfig config_;
  std::string backend_;
  std::optional<RosDock> dock_;
  std::vector<u8> png_;
  mcap::u16 image_ = 0, camera_ = 0, detections_ = 0, transforms_ = 0, pose_ = 0, frame_ = 0, health_ = 0, record_ = 0;
  Clock::time_point next_health_;
  std::uint64_t frames_ = 0, whole_frames_ = 0;
};

}  // namespace berth::cli
