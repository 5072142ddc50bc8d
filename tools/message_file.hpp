#pragma once

#include <chrono>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "recording/mcap_writer.hpp"
#include "ros2/messages.hpp"

namespace berth::cli {

/// ROS 2 messages in an MCAP file, in chunks that end by their size and age (docs/recording.md). Every Error names the
/// file.
class MessageFile {
 public:
  /// Makes the file. Throws Error.
  explicit MessageFile(const std::string& path);

  /// The wall clock stands at `wall_ns` (nanoseconds since 1970): where stamps of other clocks are carried over to it.
  void begin(std::int64_t wall_ns);
  /// At once, before the open chunk.
  void add(const mcap::Metadata& metadata) { writer_.add(metadata); }
  void add(const mcap::Attachment& attachment) { writer_.add(attachment, static_cast<u64>(start_wall_ns_)); }
  /// One of ros2's messages; or a text, std_msgs/String.
  template <class Message>
  mcap::u16 add_topic(const std::string& topic) {
    return add_topic(topic, Message::kType, ros2::schema_of(Message::kType));
  }
  mcap::u16 add_text_topic(const std::string& topic);
  /// By their numbers less 1.
  const std::vector<std::string>& topics() const { return topics_; }

  /// A source's own time as nanoseconds since 1970. The monotonic clock is carried over as it stood at the start;
  /// others count from the first such time on, which is that at which it came; without a time it is that, too.
  std::int64_t stamp_of(std::string_view clock, std::int64_t time_ns, std::int64_t came_ns);
  /// Of the messages that follow: log_time and publish_time, nanoseconds since 1970.
  void set_times(std::int64_t came_ns, std::int64_t stamp_ns);
  template <class Message>
  void send(mcap::u16 topic, const Message& message) {
    ros2::write(message, cdr_);
    send_written(topic);
  }
  void send_text(mcap::u16 topic, std::string_view text);

  /// Ends the chunk where it is time for that; whether it did. Then the disk may be waited for.
  bool end_due_chunk();
  void end_chunk() { writer_.end_chunk(); }
  /// Has what was written on the disk, where it is time for that.
  void sync_if_due();
  /// After an Error: what is whole stays. False when that failed, too.
  bool cut_back() { return writer_.cut_back(); }
  /// The end of the file: nothing may follow.
  void finish() { writer_.finish(); }
  u64 bytes() const { return writer_.bytes(); }

 private:
  using Clock = std::chrono::steady_clock;

  mcap::u16 add_topic(const std::string& topic, const std::string& type, const std::string& schema);
  void send_written(mcap::u16 topic);

  mcap::Writer writer_;
  ros2::CdrWriter cdr_;
  std::vector<std::string> topics_;
  std::vector<u32> sequences_;
  u64 log_time_ = 0, stamp_time_ = 0;  // of the messages being written
  std::int64_t start_wall_ns_ = 0, start_monotonic_ns_ = 0;
  bool has_first_ = false;
  std::int64_t first_ns_ = 0;  // the first time on a clock that is not the monotonic one
  Clock::time_point chunk_began_, synced_;
};

}  // namespace berth::cli
