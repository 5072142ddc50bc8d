// A recording for the page: where its frames are, what they hold, and the whole of it as samples.
#include "web_recording.hpp"

#include <fmt/format.h>

#include <algorithm>
#include <limits>
#include <mutex>
#include <thread>

#include "as_mat.hpp"
#include "berth/error.hpp"
#include "camera/recorded_frame.hpp"
#include "camera/ros_image.hpp"
#include "pipeline/thread_setup.hpp"
#include "recorded_result.hpp"
#include "recording/cdr_reader.hpp"
#include "recording/mcap_index.hpp"
#include "recording_setup.hpp"
#include "web_overlay.hpp"
#include "web_picture.hpp"
#include "web_times.hpp"

namespace berth::cli {
namespace {

/// Frames in the plots of the whole; of longer recordings every second one's, every third's, ….
constexpr std::size_t kPlotted = 4000;
/// Frames told of in one answer.
constexpr std::size_t kFramesAnAnswer = 4096;
constexpr u64 kNoPicture = std::numeric_limits<u64>::max();

/// Where a frame's record and picture stand.
struct FramePlace {
  std::size_t chunk;
  u64 record, picture;
};

/// One chunk's records and what it takes to read them.
struct OpenChunk {
  mcap::ChunkCodec codec;
  mcap::Bytes raw, records;
  std::size_t number = std::numeric_limits<std::size_t>::max();
};

bool is_image(const std::string& topic) { return topic.rfind(kImageTopic, 0) == 0; }

class OpenedRun final : public RecordedRun {
 public:
  explicit OpenedRun(const std::string& path)
      : path_(path), file_(path, [](const std::string& topic) { return topic == kRecordTopic || is_image(topic); }) {
    const mcap::Reader reader(path);
    const RestoredFiles files;
    // Complains of others' recordings.
    const StreamOptions options = restore_run(reader, path, files.path());
    config_ = make_config(options.engine);
    const auto& settings = reader.find_metadata(kRunMetadata)->values;
    const auto camera = settings.find(kCameraSetting);
    if (!config_.camera && camera != settings.end()) config_.camera = read_recorded_camera(camera->second, path);
    find_frames();
    say_what_is_missing();
    about_.run = new_run_name();
    about_.source = path;
    if (settings.count("backend") != 0) about_.backend = settings.at("backend");
    take_size(options.engine.camera_fit);
    sampler_.begin({about_.width, about_.height, config_, about_.backend});
    overlays_.begin({about_.width, about_.height, config_, about_.backend});
    every_ = (frames_.size() + kPlotted - 1) / kPlotted;
    thread_ = std::thread([this] {
      name_thread("berth-reading");
      read_all();
    });
  }

  ~OpenedRun() override {
    {
      const std::lock_guard<std::mutex> lock(track_mutex_);
      is_over_ = true;
    }
    thread_.join();
  }

  std::size_t frames() const override { return frames_.size(); }
  const std::string& lack() const override { return lack_; }

  Json about() const override {
    Json json = to_json(about_);
    json["recording"] = {{"frames", frames_.size()}, {"lack", lack_.empty() ? Json() : Json(lack_)}};
    return json;
  }

  Json track(std::size_t from) const override {
    const std::lock_guard<std::mutex> lock(track_mutex_);
    const std::size_t to = std::min(times_s_.size(), from + kFramesAnAnswer);
    Json json = {{"frames", frames_.size()},
                 {"read", times_s_.size()},
                 {"from", from},
                 {"times", Json::array()},
                 {"every", every_},
                 {"objects", to_json(sampler_.objects())},
                 {"beyond", sampler_.beyond()},
                 {"samples", Json::array()},
                 {"missed", missed_},
                 {"stages", stages_.json()},
                 {"problems", problems_.kept()},
                 {"problem_count", problems_.count()}};
    for (std::size_t i = from; i < to; ++i) json["times"].push_back(rounded(times_s_[i], 1e4));
    const auto before = [](const Kept& kept, std::size_t frame) { return kept.frame < frame; };
    const auto first = std::lower_bound(kept_.begin(), kept_.end(), from, before);
    for (auto kept = first; kept != kept_.end() && kept->frame < to; ++kept) {
      json["samples"].push_back(to_json(kept->sample));
    }
    return json;
  }

  Json frame(std::size_t number) override {
    double time_s = 0;
    const Json record = record_of(number, time_s);
    const RecordedResult result(record, config_, camera_, about_.backend, name_of_frame(number));
    const ObservedFrame observed = result.observed({});
    WebSampler sampler;
    sampler.begin({about_.width, about_.height, config_, about_.backend});
    Json json = {{"frame", number},
                 {"time", rounded(time_s, 1e4)},
                 {"sequence", observed.result.stamp.sequence},
                 {"label", observed.label},
                 {"status", name_of(observed.result.status)},
                 {"mode", name_of(observed.mode)},
                 {"search", observed.tracked == nullptr ? "whole frames"
                            : observed.tracked->whole   ? "the whole frame"
                                                        : "windows"},
                 {"why", observed.tracked == nullptr ? Json() : Json(name_of(observed.tracked->why))},
                 {"backend", about_.backend},
                 {"missed", result.missed()},
                 {"picture", frames_[number].picture != kNoPicture},
                 {"times", record.contains("laps_us") ? record.at("laps_us") : record.at("stages_us")},
                 {"samples", Json::array()}};
    for (const WebSample& sample : sampler.take(observed, time_s)) {
      const WebObject& object = sampler.objects()[static_cast<std::size_t>(sample.object)];
      json["samples"].push_back({{"name", object.name}, {"kind", object.kind}, {"sample", to_json(sample)}});
    }
    return json;
  }

  std::shared_ptr<const WebPicture> picture(std::size_t number) override {
    if (frames_[number].picture == kNoPicture) return nullptr;
    double time_s = 0;
    const Json record = record_of(number, time_s);
    const RosImage image = image_of(number);
    const RecordedResult result(record, config_, camera_, about_.backend, name_of_frame(number));
    Overlay overlay = overlays_.of(result.observed(image.image.view()));
    overlay.captured_s = time_s;
    const auto picture = std::make_shared<WebPicture>();
    picture->number = number;
    picture->about = to_line(to_json(overlay));
    picture->jpeg = PictureEncoder().jpeg(as_mat(image.image.view()));
    return picture;
  }

 private:
  struct Kept {
    std::size_t frame;
    WebSample sample;
  };

  std::string name_of_frame(std::size_t number) const { return fmt::format("{}: frame {}", path_, number); }

  void find_frames() {
    mcap::u16 records = 0, pictures = 0;
    bool has_records = false, has_pictures = false;
    for (const auto& [id, channel] : file_.channels()) {
      if (channel.topic == kRecordTopic) {
        records = id;
        has_records = true;
      } else if (is_image(channel.topic)) {
        pictures = id;
        has_pictures = true;
        // A picture is of the record that follows it, whichever of the two topics it is in: only one is used.
        is_compressed_ = channel.topic != kImageTopic;
      }
    }
    if (!has_records) throw Error(path_ + ": it has no records of berth run (topic " + kRecordTopic + ")");
    for (std::size_t i = 0; i < file_.chunks().size(); ++i) {
      const auto& messages = file_.chunks()[i].messages;
      const auto found = messages.find(records), seen = messages.find(pictures);
      if (found == messages.end()) continue;
      const std::vector<u64> none;
      const std::vector<u64>& images = has_pictures && seen != messages.end() ? seen->second : none;
      std::size_t next = 0;
      for (const u64 record : found->second) {
        u64 picture = kNoPicture;
        for (; next < images.size() && images[next] < record; ++next) picture = images[next];
        frames_.push_back({i, record, picture});
      }
    }
    if (frames_.empty()) throw Error(path_ + ": it has no frame; nothing was recorded before it ended");
  }

  void say_what_is_missing() {
    if (file_.by_index()) return;
    lack_ = file_.complete()
                ? "it has no index that can be gone by, so all of it was read"
                : fmt::format("it is cut off: {} of its {} bytes, behind the last whole chunk, cannot be read",
                              file_.file_bytes() - file_.whole_bytes(), file_.file_bytes());
    const mcap::Problems& problems = file_.problems();
    if (problems.count() > 0) lack_ += "; " + problems.kept().front();
    if (problems.count() > 1) lack_ += fmt::format(", and {} more", problems.count() - 1);
    lack_ += "; berth recover makes a whole file of the rest";
  }

  /// The first picture's; the camera's where there is none.
  void take_size(CameraFit fit) {
    const auto first = std::find_if(frames_.begin(), frames_.end(),
                                    [](const FramePlace& place) { return place.picture != kNoPicture; });
    if (config_.camera) {
      about_.width = config_.camera->width;
      about_.height = config_.camera->height;
    }
    if (first != frames_.end()) {
      try {
        const RosImage image = image_of(static_cast<std::size_t>(first - frames_.begin()));
        about_.width = image.image.width();
        about_.height = image.image.height();
      } catch (const Error&) {
        // Damaged: read_all tells of it, and the rest can be looked at.
      }
    }
    // It detects nothing, and needs no backend for that.
    camera_ = Engine({}, config_, fit).camera_for(about_.width, about_.height);
    about_.camera = camera_;
  }

  /// Valid until the next call with the same `open`.
  const mcap::Bytes& open_chunk(std::size_t number, OpenChunk& open) const {
    if (open.number == number) return open.records;
    open.number = std::numeric_limits<std::size_t>::max();
    const std::string wrong = file_.read_chunk(number, open.codec, open.raw, open.records);
    if (!wrong.empty()) throw Error(path_ + ": " + wrong);
    open.number = number;
    return open.records;
  }

  mcap::Message message_of(const mcap::Bytes& records, u64 place, std::size_t number) const {
    const std::optional<mcap::Message> message = mcap::message_at(records, place);
    if (!message) throw Error(name_of_frame(number) + ": it is not where the index says; see berth recover");
    return *message;
  }

  Json parse_record(const mcap::Message& message, std::size_t number, double& time_s) const {
    CdrReader fields(message.data, message.size);
    Json record = Json::parse(fields.string(), nullptr, false);
    if (!record.is_object()) throw Error(name_of_frame(number) + ": its record is damaged");
    // The frame's own time; by the first frame's, which the first request may come before.
    const std::int64_t at_ns = static_cast<std::int64_t>(message.publish_time);
    // Both are the file's: they may be anything.
    const u64 since_first = static_cast<u64>(at_ns) - static_cast<u64>(first_ns(number, at_ns));
    time_s = static_cast<double>(static_cast<std::int64_t>(since_first)) / 1e9;
    return record;
  }

  std::int64_t first_ns(std::size_t number, std::int64_t at_ns) const {
    if (number == 0) return at_ns;
    std::call_once(has_first_, [this] {
      OpenChunk open;
      try {
        const mcap::Bytes& records = open_chunk(frames_.front().chunk, open);
        first_ns_ = static_cast<std::int64_t>(message_of(records, frames_.front().record, 0).publish_time);
      } catch (const Error&) {
        // Without it, times are since 1970; read_all tells of the damage.
      }
    });
    return first_ns_;
  }

  Json record_of(std::size_t number, double& time_s) {
    const std::lock_guard<std::mutex> lock(chunk_mutex_);
    const mcap::Bytes& records = open_chunk(frames_[number].chunk, asked_);
    return parse_record(message_of(records, frames_[number].record, number), number, time_s);
  }

  RosImage image_of(std::size_t number) {
    const std::lock_guard<std::mutex> lock(chunk_mutex_);
    const mcap::Bytes& records = open_chunk(frames_[number].chunk, asked_);
    const mcap::Message message = message_of(records, frames_[number].picture, number);
    return read_ros_image(message.data, message.size, is_compressed_, name_of_frame(number));
  }

  /// Every frame once, in order: speeds are slopes of those before.
  void read_all() {
    make_ordinary();
    OpenChunk open;
    double last_s = 0;
    for (std::size_t i = 0; i < frames_.size(); ++i) {
      double time_s = last_s;
      std::optional<RecordedResult> result;
      std::string wrong;
      try {
        const mcap::Bytes& records = open_chunk(frames_[i].chunk, open);
        const Json record = parse_record(message_of(records, frames_[i].record, i), i, time_s);
        result.emplace(record, config_, camera_, about_.backend, name_of_frame(i));
      } catch (const std::exception& error) {  // a damaged file may ask for more memory than there is
        wrong = error.what();
      }
      // A scenario played round begins anew; the page's time does not.
      last_s = std::max(last_s, time_s);
      const std::lock_guard<std::mutex> lock(track_mutex_);
      if (is_over_) return;
      times_s_.push_back(last_s);
      if (!result) {
        problems_.add(wrong);
        continue;
      }
      missed_ += result->missed();
      const ObservedFrame observed = result->observed({});
      stages_.add(observed);
      for (const WebSample& sample : sampler_.take(observed, last_s)) {
        if (i % every_ == 0) kept_.push_back({i, sample});
      }
    }
  }

  const std::string path_;
  const mcap::IndexedFile file_;
  DetectorConfig config_;
  WebAbout about_;
  std::optional<CameraModel> camera_;
  std::string lack_;
  std::vector<FramePlace> frames_;
  bool is_compressed_ = false;
  OverlayMaker overlays_;
  mutable std::once_flag has_first_;
  mutable std::int64_t first_ns_ = 0;

  /// What viewers asked for last.
  std::mutex chunk_mutex_;
  OpenChunk asked_;

  mutable std::mutex track_mutex_;
  bool is_over_ = false;
  std::vector<double> times_s_;
  std::vector<Kept> kept_;
  std::size_t every_ = 1;
  WebSampler sampler_;
  WebTimes stages_;
  std::uint64_t missed_ = 0;
  mcap::Problems problems_;
  std::thread thread_;
};

}  // namespace

std::unique_ptr<RecordedRun> RecordedRun::open(const std::string& path) { return std::make_unique<OpenedRun>(path); }

}  // namespace berth::cli
