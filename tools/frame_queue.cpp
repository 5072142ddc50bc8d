#include "frame_queue.hpp"

#include <algorithm>
#include <utility>

#include "marker_filters.hpp"

namespace berth::cli {
namespace {

constexpr std::size_t kFramesAPicture = 4;
/// Markers in a frame that memory is taken for at the start.
constexpr std::size_t kMarkers = 8;

void copy(View2D<const u8> from, GrayImage& to) {
  if (to.width() != from.width || to.height() != from.height) to = GrayImage(from.width, from.height);
  for (int y = 0; y < from.height; ++y) std::copy_n(from.row(y), from.width, to.view().row(y));
}

}  // namespace

ObservedFrame QueuedFrame::observed(View2D<const u8> image) const {
  return {label,
          image,
          result,
          digest,
          mode,
          camera,
          is_tracked ? &tracked : nullptr,
          is_paced ? &paced : nullptr,
          truth,
          truth_targets,
          backend,
          wall_ns,
          health,
          engine,
          nullptr,
          nullptr};
}

FrameQueue::FrameQueue(std::size_t frames, bool pictures, int width, int height)
    : pictures_(pictures), frames_(frames * kFramesAPicture) {
  for (QueuedFrame& frame : frames_) {
    frame.label.reserve(128);
    frame.result.detections.reserve(kMarkers);
    frame.result.bundles.reserve(kMarkers);
    frame.result.disc_targets.reserve(kMarkers);
    frame.tracked.windows.reserve(kMarkers);
    frame.truth.reserve(kMarkers);
    frame.truth_targets.reserve(kMarkers);
  }
  if (!pictures_) return;
  for (std::size_t i = 0; i < frames; ++i) {
    images_.emplace_back(width, height);
    free_images_.push_back(static_cast<int>(i));
  }
}

void FrameQueue::push(const ObservedFrame& frame, std::int64_t came_ns, bool wait) {
  QueuedFrame* to = nullptr;
  {
    std::unique_lock<std::mutex> lock(mutex_);
    if (wait) {
      went_.wait(lock, [&] { return closed_ || (count_ < frames_.size() && (!pictures_ || !free_images_.empty())); });
    }
    if (closed_ || count_ == frames_.size()) {
      ++missed_;
      ++dropped_frames_;
      return;
    }
    to = &frames_[(first_ + count_) % frames_.size()];
    to->picture = -1;
    if (pictures_ && !free_images_.empty()) {
      to->picture = free_images_.back();
      free_images_.pop_back();
    } else if (pictures_) {
      ++dropped_pictures_;
    }
    to->missed_frames = std::exchange(missed_, 0);
  }
  // Nobody else looks at the place until it is counted.
  to->label = frame.label;
  to->result = frame.result;
  to->digest = frame.digest;
  to->mode = frame.mode;
  to->camera = frame.camera;
  to->is_tracked = frame.tracked != nullptr;
  if (to->is_tracked) to->tracked = *frame.tracked;
  to->tracked.result = &to->result;
  to->is_paced = frame.paced != nullptr;
  if (to->is_paced) to->paced = *frame.paced;
  to->paced.result = &to->result;
  to->paced.image = {};
  to->truth = frame.truth;
  to->truth_targets = frame.truth_targets;
  to->backend = frame.backend;
  to->wall_ns = frame.wall_ns;
  to->health = frame.health;
  to->engine = frame.engine;
  to->came_ns = came_ns;
  to->filtered = frame.filters != nullptr ? frame.filters->to_json() : Json();
  if (to->picture >= 0) copy(frame.image, images_[static_cast<std::size_t>(to->picture)]);
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    ++count_;
  }
  came_.notify_one();
}

void FrameQueue::close() {
  {
    const std::lock_guard<std::mutex> lock(mutex_);
    closed_ = true;
  }
  came_.notify_one();
  went_.notify_one();
}

const QueuedFrame* FrameQueue::next(std::chrono::milliseconds patience, bool& closed) {
  std::unique_lock<std::mutex> lock(mutex_);
  if (given_) {
    const int picture = frames_[first_].picture;
    if (picture >= 0) free_images_.push_back(picture);
    first_ = (first_ + 1) % frames_.size();
    --count_;
    given_ = false;
    went_.notify_one();
  }
  came_.wait_for(lock, patience, [&] { return count_ > 0 || closed_; });
  closed = closed_ && count_ == 0;
  if (count_ == 0) return nullptr;
  given_ = true;
  return &frames_[first_];
}

View2D<const u8> FrameQueue::picture(const QueuedFrame& frame) const {
  if (frame.picture < 0) return {};
  return images_[static_cast<std::size_t>(frame.picture)].view();
}

std::uint64_t FrameQueue::dropped_frames() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return dropped_frames_;
}

std::uint64_t FrameQueue::dropped_pictures() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return dropped_pictures_;
}

}  // namespace berth::cli
