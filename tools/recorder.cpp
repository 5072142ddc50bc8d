#include "recorder.hpp"

#include <fmt/format.h>

#include <chrono>
#include <exception>
#include <map>
#include <utility>

#include "berth/error.hpp"
#include "camera/bad_input.hpp"
#include "pipeline/thread_setup.hpp"
#include "unix_time.hpp"

namespace berth::cli {
namespace {

/// How long the writer's thread sleeps at most: chunks end by their age even when no frame comes.
constexpr std::chrono::milliseconds kPatience{200};
constexpr int kMostQueued = 100000;

const RecordOptions& checked(const RecordOptions& options) {
  if (options.queue < 1 || options.queue > kMostQueued) {
    throw bad_field("command line", "--record-queue", std::to_string(options.queue), "give frames, 1 to 100000");
  }
  return options;
}

}  // namespace

Recorder::Recorder(const RecordOptions& options, RecordingSetup setup, bool paced,
                   const std::optional<CameraModel>& camera, Console& console)
    : options_(checked(options)),
      setup_(std::move(setup)),
      paced_(paced),
      camera_(camera),
      console_(console),
      file_(options.file, options.pictures) {}

Recorder::~Recorder() { stop(); }

void Recorder::begin(const ObservedStream& stream) {
  queue_ = std::make_unique<FrameQueue>(static_cast<std::size_t>(options_.queue),
                                        options_.pictures != RecordPictures::none, stream.width, stream.height);
  file_.begin(setup_, stream.config, stream.backend, camera_ ? camera_ : stream.config.camera, unix_ns());
  writer_ = std::thread([this] {
    name_thread("berth-recorder");
    work();
  });
}

void Recorder::observe(const ObservedFrame& frame) {
  queue_->push(frame, unix_ns(), !paced_);
  if (!failed_ || told_) return;
  told_ = true;
  console_.complain(failure_ + "; the run goes on, nothing more is recorded");
}

/// In the writer's thread, or after it.
std::uint64_t Recorder::dropped_frames() const { return queue_->dropped_frames() + (taken_ - file_.frames()); }

void Recorder::end_file() { file_.finish(queue_->dropped_pictures(), dropped_frames()); }

void Recorder::write(const QueuedFrame* frame, bool closed) {
  if (frame != nullptr) {
    file_.write(*frame, queue_->picture(*frame), queue_->dropped_pictures(), queue_->dropped_frames());
  } else if (closed) {
    end_file();
  } else {
    file_.keep_up();
  }
}

void Recorder::work() {
  bool closed = false;
  while (!closed) {
    const QueuedFrame* const frame = queue_->next(kPatience, closed);
    taken_ += frame != nullptr ? 1 : 0;
    if (failed_) continue;
    try {
      write(frame, closed);
    } catch (const std::exception& error) {
      failure_ = error.what();
      failed_ = true;
      // The room that the last, half-written chunk took is mostly enough for the summary. Where it is not, berth
      // recover makes one.
      try {
        if (file_.cut_back()) end_file();
      } catch (const std::exception&) {
        file_.cut_back();
      }
    }
  }
}

void Recorder::stop() {
  if (!writer_.joinable()) return;
  queue_->close();
  writer_.join();
}

void Recorder::finish(std::ostream& people) {
  stop();
  if (!queue_) file_.finish(0, 0);  // no frame came
  people << fmt::format("recording   {}: {} frame{}, {:.1f} MB", options_.file, file_.frames(),
                        file_.frames() == 1 ? "" : "s", static_cast<double>(file_.bytes()) / 1e6);
  std::map<std::string, std::uint64_t> dropped;
  if (queue_) dropped = file_.dropped_by_topic(queue_->dropped_pictures(), dropped_frames());
  const char* before = "; dropped ";
  for (const auto& [topic, count] : dropped) {
    people << before << count << " of " << topic;
    before = ", ";
  }
  people << '\n';
  if (failed_ && !told_) console_.complain(failure_);
}

}  // namespace berth::cli
