#include "moment_recorder.hpp"

#include <fmt/format.h>

#include <exception>
#include <fstream>
#include <iterator>
#include <thread>
#include <utility>

#include "moment_record.hpp"
#include "recording_file.hpp"
#include "unix_time.hpp"

namespace berth::cli {
namespace {

/// Most of a second of cameras of 300 frames/s.
constexpr std::size_t kSlots = 256;
/// Chunks end by their age even when no moment comes.
constexpr std::chrono::milliseconds kPatience{200};
constexpr std::chrono::seconds kHealthEvery{1};

}  // namespace

MomentRecorder::MomentRecorder(MomentRecording recording, Console& console)
    : recording_(std::move(recording)), console_(console), health_(recording_.gate) {}

template <class Work>
void MomentRecorder::guarded(const Work& work) {
  if (failed_) return;
  try {
    work();
  } catch (const std::exception& error) {
    failure_ = error.what();
    failed_ = true;
    // As Recorder does: what is whole stays, with a summary where there is room for one.
    moments_ = whole_moments_;
    try {
      if (file_->cut_back()) end_file();
    } catch (const std::exception&) {
      file_->cut_back();
    }
  }
}

MomentRecorder::~MomentRecorder() {
  if (!worker_) return;
  worker_.reset();
  guarded([this] { end_file(); });
}

void MomentRecorder::begin() {
  file_ = std::make_unique<MessageFile>(recording_.file);
  file_->begin(unix_ns());
  file_->add(mcap::Metadata{kStationsMetadata, recording_.settings});
  std::ifstream stations(recording_.stations_file, std::ios::binary);
  file_->add(
      mcap::Attachment{"stations.toml", "application/toml", mcap::Bytes(std::istreambuf_iterator<char>(stations), {})});
  pose_ = file_->add_topic<ros2::PoseWithCovarianceStamped>("/berth/pose");
  transform_ = file_->add_topic<ros2::TransformList>("/tf");
  diagnostics_ = file_->add_topic<ros2::DiagnosticArray>("/diagnostics");
  record_ = file_->add_text_topic(kMomentTopic);
  worker_ = std::make_unique<BoundedWorker<Item>>(
      "berth-recorder", kSlots, [this](Item& item) { guarded([&] { write(item); }); }, kPatience,
      [this] { guarded([this] { keep_up(); }); });
}

void MomentRecorder::observe(const ObservedMoment& observed) {
  ++observed_;
  const auto offer = [&] {
    return worker_->offer([&](Item& item) { item = {unix_ns(), observed.moment, observed.fused, observed.counts}; });
  };
  while (!offer()) {
    if (observed.is_live) {
      ++dropped_;
      break;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(1));
  }
  if (!failed_ || told_) return;
  told_ = true;
  console_.complain(failure_ + "; the stations go on, nothing more of both is recorded");
}

void MomentRecorder::write(const Item& item) {
  const FusedPose& fused = item.fused;
  const std::int64_t stamp_ns = file_->stamp_of(clock_of(item.moment), fused.time_ns, item.came_ns);
  file_->set_times(item.came_ns, stamp_ns);
  health_.add(item.moment, fused, item.counts);
  write_health(item.came_ns);
  if (is_agreed(fused)) {
    file_->send(pose_, robot_message(stamp_ns, recording_.frames, fused.robot));
    file_->send(transform_, dock_transform(stamp_ns, recording_.frames, fused.robot));
  }
  // Last: a moment that has it has all that belongs to it.
  file_->send_text(record_, to_line(moment_record(item.moment, fused)));
  ++moments_;
  keep_up();
}

void MomentRecorder::write_health(std::int64_t came_ns) {
  const auto now = std::chrono::steady_clock::now();
  if (now < next_health_) return;
  next_health_ = now + kHealthEvery;
  ros2::DiagnosticStatus recorder;
  recorder.level = dropped_ > 0 ? ros2::Level::warn : ros2::Level::ok;
  recorder.name = "berth: recorder";
  recorder.message = dropped_ > 0 ? "the disk does not keep up" : "everything is recorded";
  recorder.values = {{"moments", fmt::to_string(moments_)}, {"dropped_moments", fmt::to_string(dropped_.load())}};
  file_->send(diagnostics_, ros2::DiagnosticArray{{came_ns, ""}, {health_.report(), recorder}});
}

void MomentRecorder::keep_up() {
  if (!file_->end_due_chunk()) return;
  whole_moments_ = moments_;
  file_->sync_if_due();
}

void MomentRecorder::end_file() {
  file_->end_chunk();
  whole_moments_ = moments_;
  mcap::Metadata end{kEndMetadata, {{"moments", std::to_string(moments_)}}};
  if (dropped_ > 0) end.values["dropped"] = std::to_string(dropped_);
  file_->add(end);
  file_->finish();
}

void MomentRecorder::finish(const BothCounts&, std::ostream& people) {
  worker_.reset();
  guarded([this] { end_file(); });
  people << fmt::format("recording   {}: {} moment{}, {:.1f} MB{}\n", recording_.file, moments_,
                        moments_ == 1 ? "" : "s", static_cast<double>(file_->bytes()) / 1e6,
                        moments_ < observed_ ? fmt::format("; dropped {}", observed_ - moments_) : "");
  if (failed_ && !told_) console_.complain(failure_);
}

}  // namespace berth::cli
