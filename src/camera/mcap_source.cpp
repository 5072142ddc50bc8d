#include <algorithm>
#include <set>
#include <utility>

#include "berth/error.hpp"
#include "camera/recorded_frame.hpp"
#include "camera/ros_image.hpp"
#include "camera/sources.hpp"
#include "recording/cdr_reader.hpp"
#include "recording/mcap_reader.hpp"

namespace berth {
namespace {

constexpr const char *kImage = "sensor_msgs/msg/Image", *kCompressedImage = "sensor_msgs/msg/CompressedImage";

class McapSource final : public Source {
 public:
  explicit McapSource(const std::string& path) : path_(path), reader_(path) {
    const mcap::Metadata* const run = reader_.find_metadata(kRunMetadata);
    if (run == nullptr) return;
    const auto camera = run->values.find(kCameraSetting);
    if (camera != run->values.end()) camera_ = read_recorded_camera(camera->second, path_);
  }

  std::optional<SourceFrame> next() override {
    while (const mcap::Message* message = reader_.next()) {
      const mcap::Schema* const schema = reader_.schema_of_channel(message->channel);
      if (schema == nullptr) continue;
      const std::string& topic = reader_.channels().at(message->channel).topic;
      if (schema->name == kImage || schema->name == kCompressedImage) {
        if (image_topic_.empty()) image_topic_ = topic;
        if (topic != image_topic_) continue;
        take_image(*message, schema->name == kCompressedImage);
        if (!has_records()) return image_alone();
      } else if (topic == kRecordTopic) {
        if (std::optional<SourceFrame> frame = take_record(*message)) return frame;
      }
    }
    tell_what_is_missing();
    return std::nullopt;
  }

  SourceHealth health() const override { return health_; }
  std::optional<CameraModel> camera() const override { return camera_; }

 private:
  /// Berth's own recordings say with each frame what it was.
  bool has_records() const {
    const auto& channels = reader_.channels();
    return std::any_of(channels.begin(), channels.end(),
                       [](const auto& channel) { return channel.second.topic == kRecordTopic; });
  }

  std::string label() const { return path_ + "#" + std::to_string(sequence_); }

  void take_image(const mcap::Message& message, bool compressed) {
    image_ = {};
    try {
      RosImage read = read_ros_image(message.data, message.size, compressed, label());
      image_ = std::move(read.image);
      stamp_ns_ = read.stamp_ns;
    } catch (const Error&) {
      ++sequence_;
      throw;
    }
  }

  /// A frame of somebody else's recording.
  SourceFrame image_alone() {
    SourceFrame frame;
    frame.label = label();
    frame.stamp.sequence = sequence_++;
    frame.stamp.exposure_start_ns = frame.stamp.mid_exposure_ns = stamp_ns_;
    frame.stamp.clock = "ros";
    frame.image = std::move(image_);
    return frame;
  }

  std::optional<SourceFrame> take_record(const mcap::Message& message) {
    GrayImage image = std::exchange(image_, {});
    CdrReader fields(message.data, message.size);
    RecordedFrame recorded = read_recorded_frame(fields.string(), label());
    ++sequence_;
    health_.lost += recorded.missed;
    if (image.width() == 0) {
      ++health_.lost;
      return std::nullopt;
    }
    recorded.frame.image = std::move(image);
    // Frames' stamps only point to it.
    recorded.frame.stamp.clock = clocks_.insert(recorded.clock).first->c_str();
    return std::move(recorded.frame);
  }

  /// Once: the frames are there all the same.
  void tell_what_is_missing() {
    if (told_) return;
    told_ = true;
    const mcap::Problems& problems = reader_.problems();
    if (problems.count() > 0) {
      throw Error(path_ + ": " + problems.kept().front() +
                  (problems.count() > 1 ? ", and " + std::to_string(problems.count() - 1) + " more" : "") +
                  "; see berth recover");
    }
    if (!reader_.complete()) {
      throw Error(path_ + ": it is cut off: " + std::to_string(reader_.file_bytes() - reader_.whole_bytes()) +
                  " bytes behind the last whole chunk cannot be read; berth recover makes a whole file of the rest");
    }
  }

  std::string path_;
  mcap::Reader reader_;
  std::optional<CameraModel> camera_;
  std::string image_topic_;
  GrayImage image_;  // that came last and is no frame yet
  std::int64_t stamp_ns_ = 0;
  u64 sequence_ = 0;
  SourceHealth health_;
  std::set<std::string> clocks_;
  bool told_ = false;
};

}  // namespace

std::unique_ptr<Source> open_mcap(const std::string& path) { return std::make_unique<McapSource>(path); }

}  // namespace berth
