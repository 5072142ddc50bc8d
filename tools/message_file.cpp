#include "message_file.hpp"

#include <algorithm>

#include "monotonic.hpp"

namespace berth::cli {
namespace {

/// A chunk ends with the frame that fills it so far, or so long after its first; then the disk is waited for, at most
/// so often: what a loss of power costs.
constexpr std::size_t kChunkBytes = std::size_t{1} << 20;
constexpr std::chrono::seconds kChunkAge{1}, kSyncEvery{1};

}  // namespace

MessageFile::MessageFile(const std::string& path)
    : writer_(path, "ros2", "berth " BERTH_VERSION), synced_(Clock::now()) {}

void MessageFile::begin(std::int64_t wall_ns) {
  start_wall_ns_ = wall_ns;
  start_monotonic_ns_ = monotonic_ns();
}

mcap::u16 MessageFile::add_topic(const std::string& topic, const std::string& type, const std::string& schema) {
  const mcap::u16 id = static_cast<mcap::u16>(topics_.size() + 1);
  writer_.add(mcap::Schema{id, type, "ros2msg", schema});
  writer_.add(mcap::Channel{id, id, topic, "cdr", {}});
  topics_.push_back(topic);
  sequences_.push_back(0);
  return id;
}

mcap::u16 MessageFile::add_text_topic(const std::string& topic) {
  return add_topic(topic, "std_msgs/msg/String", "string data\n");
}

std::int64_t MessageFile::stamp_of(std::string_view clock, std::int64_t time_ns, std::int64_t came_ns) {
  if (clock == "none") return came_ns;
  if (clock == "monotonic") return start_wall_ns_ + (time_ns - start_monotonic_ns_);
  if (!has_first_) first_ns_ = time_ns - came_ns;
  has_first_ = true;
  return time_ns - first_ns_;
}

void MessageFile::set_times(std::int64_t came_ns, std::int64_t stamp_ns) {
  log_time_ = static_cast<u64>(std::max<std::int64_t>(came_ns, 0));
  stamp_time_ = static_cast<u64>(std::max<std::int64_t>(stamp_ns, 0));
}

void MessageFile::send_written(mcap::u16 topic) {
  const std::vector<u8>& bytes = cdr_.bytes();
  if (writer_.waiting() == 0) chunk_began_ = Clock::now();
  writer_.write({topic, sequences_[topic - 1U]++, log_time_, stamp_time_, bytes.data(), bytes.size()});
}

void MessageFile::send_text(mcap::u16 topic, std::string_view text) {
  cdr_.begin();
  cdr_.string(text);
  send_written(topic);
}

bool MessageFile::end_due_chunk() {
  if (writer_.waiting() == 0 || (writer_.waiting() < kChunkBytes && Clock::now() - chunk_began_ < kChunkAge)) {
    return false;
  }
  writer_.end_chunk();
  return true;
}

void MessageFile::sync_if_due() {
  if (Clock::now() - synced_ < kSyncEvery) return;
  writer_.sync();
  synced_ = Clock::now();
}

}  // namespace berth::cli
