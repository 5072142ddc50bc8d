#include "soak_source.hpp"

#include <utility>

#include "camera/live_source.hpp"

namespace berth::cli {
namespace {

LiveOptions live_options() {
  LiveOptions options;
  options.name = "film";
  // One: the film is no ring of buffers in which newer frames wait.
  options.buffers = 1;
  return options;
}

}  // namespace

SoakSource::SoakSource(FaultyFilm& film, const CameraModel& camera)
    : film_(film), model_(camera), camera_(open_live(live_options(), film.opener())) {}

void SoakSource::note(u64 sequence) {
  const std::lock_guard<std::mutex> lock(mutex_);
  frames_[sequence] = film_.last();
  ++handed_on_;
}

std::optional<SourceFrame> SoakSource::next() {
  std::optional<SourceFrame> frame = camera_->next();
  if (frame) note(frame->stamp.sequence);
  return frame;
}

FrameStamp SoakSource::await() {
  const FrameStamp stamp = camera_->await();
  awaited_ = stamp.sequence;
  return stamp;
}

bool SoakSource::fetch(View2D<u8> image) {
  if (!camera_->fetch(image)) return false;
  note(awaited_);
  return true;
}

std::optional<FilmedFrame> SoakSource::handed_on(u64 sequence) {
  const std::lock_guard<std::mutex> lock(mutex_);
  const auto found = frames_.find(sequence);
  frames_.erase(frames_.begin(), frames_.lower_bound(sequence));
  if (found == frames_.end()) return std::nullopt;
  return found->second;
}

u64 SoakSource::handed_on_in_all() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return handed_on_;
}

}  // namespace berth::cli
