#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <ostream>
#include <string>
#include <string_view>

#include "ros2/dds.hpp"
#include "ros2/messages.hpp"
#include "ros_options.hpp"
#include "unix_time.hpp"

namespace berth::cli {

/// A source's time as messages are stamped: as it is with RosPlan::source_time, else as system time where its clock is
/// the system's monotonic one, else now.
std::int64_t ros_stamp_ns(const RosPlan& plan, std::string_view clock, std::int64_t time_ns);

/// What one thread writes messages with, and counts.
struct RosSender {
  ros2::CdrWriter cdr;
  std::uint64_t unsent = 0;
};

/// The topics of a plan, written to.
class RosWriters {
 public:
  /// Throws Error where the network cannot be had.
  explicit RosWriters(const RosPlan& plan);

  /// Until each topic that does not keep messages for later readers has one, RosPlan::wait_s at most.
  void wait_for_readers() const;
  /// Nothing where the topic is off.
  template <class Message>
  void send(RosTopic topic, const Message& message, RosSender& sender) {
    const auto i = static_cast<std::size_t>(topic);
    if (!writers_[i]) return;
    write(message, sender.cdr);
    if (writers_[i]->send(sender.cdr)) {
      ++sent_[i];
    } else {
      ++sender.unsent;
    }
  }
  /// Topics that readers ask more of than they offer: "pose (reliability)", …
  std::string refused() const;
  /// After the last message: waits a second at most for readers to acknowledge them, and says what was sent, for
  /// people. `head`: the first line's end. `unsent`: of all senders.
  void sum_up(std::ostream& people, const std::string& head, std::uint64_t unsent) const;

 private:
  const std::array<RosTopicPlan, kRosTopics> topics_;
  const double wait_s_;
  ros2::Participant participant_;
  /// By RosTopic; null for those that are off.
  std::array<std::unique_ptr<ros2::TopicWriter>, kRosTopics> writers_;
  std::array<std::atomic<std::uint64_t>, kRosTopics> sent_ = {};
};

}  // namespace berth::cli
