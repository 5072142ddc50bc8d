#include <algorithm>
#include <array>
#include <set>
#include <utility>

#include "berth/error.hpp"
#include "camera/decoders.hpp"
#include "camera/recorded_frame.hpp"
#include "camera/sources.hpp"
#include "recording/cdr_reader.hpp"
#include "recording/mcap_reader.hpp"

namespace berth {
namespace {

constexpr const char *kImage = "sensor_msgs/msg/Image", *kCompressedImage = "sensor_msgs/msg/CompressedImage";
constexpr std::int64_t kSecond = 1'000'000'000;

/// How a ROS image's pixels lie: bytes of one pixel, and where its red, green and blue are, or its gray.
struct Encoding {
  const char* name;
  std::size_t bytes, red, green, blue;
  bool gray() const { return red == green; }
};
constexpr std::array<Encoding, 7> kEncodings = {{{"mono8", 1, 0, 0, 0},
                                                 {"8UC1", 1, 0, 0, 0},
                                                 {"mono16", 2, 0, 0, 0},
                                                 {"rgb8", 3, 0, 1, 2},
                                                 {"bgr8", 3, 2, 1, 0},
                                                 {"rgba8", 4, 0, 1, 2},
                                                 {"bgra8", 4, 2, 1, 0}}};

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
    CdrReader fields(message.data, message.size);
    stamp_ns_ = std::int64_t{static_cast<s32>(fields.uint32())} * kSecond;
    stamp_ns_ += fields.uint32();
    fields.string();  // frame_id
    if (compressed) {
      fields.string();  // format: the file says it itself
      std::size_t size = 0;
      const u8* const file = fields.bytes(size);
      if (!fields.ok()) fail("an image is damaged");
      const std::vector<u8> bytes(file, file + size);
      const bool png = size > 0 && bytes[0] == 0x89;
      image_ = png ? decode_png(bytes, label()) : decode_jpeg(bytes, label());
      return;
    }
    const u32 height = fields.uint32(), width = fields.uint32();
    const std::string encoding = fields.string();
    const bool big_endian = fields.uint8() != 0;
    const u32 step = fields.uint32();
    std::size_t size = 0;
    const u8* const pixels = fields.bytes(size);
    if (!fields.ok()) fail("an image is damaged");
    check_image_size(width, height, label());
    const auto known =
        std::find_if(kEncodings.begin(), kEncodings.end(), [&](const Encoding& one) { return encoding == one.name; });
    if (known == kEncodings.end()) {
      fail("its encoding '" + encoding + "' is not supported; record mono8, mono16, rgb8 or bgr8");
    }
    if (step < u64{width} * known->bytes || size < u64{step} * height) fail("an image is smaller than it says");
    image_ = GrayImage(static_cast<int>(width), static_cast<int>(height));
    for (u32 y = 0; y < height; ++y) {
      gray_row(pixels + std::size_t{y} * step, *known, big_endian, image_.view().row(static_cast<int>(y)), width);
    }
  }

  static void gray_row(const u8* from, const Encoding& encoding, bool big_endian, u8* to, u32 width) {
    for (u32 x = 0; x < width; ++x, from += encoding.bytes) {
      if (encoding.bytes == 2) {
        const u32 value = big_endian ? u32{from[0]} << 8 | from[1] : u32{from[1]} << 8 | from[0];
        to[x] = static_cast<u8>((value + 128) / 257);
      } else {
        to[x] = encoding.gray() ? from[0]
                                : static_cast<u8>(luma(from[encoding.red], from[encoding.green], from[encoding.blue]));
      }
    }
  }

  [[noreturn]] void fail(const std::string& why) {
    const std::string frame = label();
    ++sequence_;
    throw Error(frame + ": " + why);
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
