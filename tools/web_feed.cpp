#include "web_feed.hpp"

#include <algorithm>

namespace berth::cli {
namespace {

/// What waits while a reader holds the lock: some seconds' samples.
constexpr std::size_t kWaiting = 1024;

}  // namespace

WebFeed::WebFeed() : ring_(kKept) {
  waiting_.reserve(kWaiting);
  objects_.reserve(WebSampler::kMost);
}

double WebFeed::now_s() const {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - began_).count();
}

void WebFeed::publish(const WebStatus& status, const std::vector<WebSample>& samples,
                      const std::vector<WebObject>& objects) {
  for (const WebSample& sample : samples) {
    if (waiting_.size() < kWaiting) {
      waiting_.push_back(sample);
    } else {
      ++lost_;
    }
  }
  const std::unique_lock<std::mutex> lock(mutex_, std::try_to_lock);
  if (!lock) return;
  status_ = status;
  while (objects_.size() < objects.size()) objects_.push_back(objects[objects_.size()]);
  for (const WebSample& sample : waiting_) ring_[written_++ % kKept] = sample;
  waiting_.clear();
}

void WebFeed::show(std::shared_ptr<const WebPicture> picture) {
  {
    const std::lock_guard<std::mutex> lock(picture_mutex_);
    picture_ = std::move(picture);
  }
  changed_.notify_all();
}

void WebFeed::end() {
  {
    const std::lock_guard<std::mutex> lock(picture_mutex_);
    ended_ = true;
  }
  changed_.notify_all();
}

void WebFeed::close() {
  {
    const std::lock_guard<std::mutex> lock(picture_mutex_);
    closed_ = true;
  }
  changed_.notify_all();
}

WebStatus WebFeed::status() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return status_;
}

std::vector<WebObject> WebFeed::objects(std::size_t from) const {
  const std::lock_guard<std::mutex> lock(mutex_);
  if (from >= objects_.size()) return {};
  return {objects_.begin() + static_cast<std::ptrdiff_t>(from), objects_.end()};
}

u64 WebFeed::newest() const {
  const std::lock_guard<std::mutex> lock(mutex_);
  return written_;
}

std::vector<WebSample> WebFeed::samples(u64& cursor, std::size_t most) const {
  std::vector<WebSample> samples;
  samples.reserve(most);
  const std::lock_guard<std::mutex> lock(mutex_);
  const u64 oldest = written_ > kKept ? written_ - kKept : 0;
  cursor = std::clamp(cursor, oldest, written_);
  for (; cursor < written_ && samples.size() < most; ++cursor) samples.push_back(ring_[cursor % kKept]);
  return samples;
}

std::shared_ptr<const WebPicture> WebFeed::picture(u64 after, std::chrono::milliseconds wait) const {
  std::unique_lock<std::mutex> lock(picture_mutex_);
  const auto is_there = [&] { return picture_ && picture_->number > after; };
  changed_.wait_for(lock, wait, [&] { return closed_ || is_there(); });
  return is_there() ? picture_ : nullptr;
}

void WebFeed::sleep(std::chrono::milliseconds time) const {
  std::unique_lock<std::mutex> lock(picture_mutex_);
  const bool ended = ended_;
  changed_.wait_for(lock, time, [&] { return closed_ || ended_ != ended; });
}

}  // namespace berth::cli
