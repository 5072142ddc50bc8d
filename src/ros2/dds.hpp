#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include "ros2/cdr.hpp"

struct ddsi_sertype;

/// Sending messages to ROS 2 nodes by Cyclone DDS, with names and types as rmw_cyclonedds has them (docs/ros2.md).
/// Source: REP-2003…2009's names, as rmw_dds_common and rmw_cyclonedds_cpp apply them.
namespace berth::ros2 {

/// How a topic's messages reach those who read it. Readers that ask for more than this get nothing.
struct Qos {
  /// Sent again until each reader has it; else best effort.
  bool reliable = true;
  /// The last `depth` messages are kept for readers that come later ("transient local"); else "volatile".
  bool latched = false;
  /// Messages kept for a reader that is slow; the oldest are lost beyond.
  int depth = 10;
};

/// A member of one domain of DDS: what sees it, and is seen.
class Participant {
 public:
  /// `domain`: 0 to 232, as ROS_DOMAIN_ID. What else there is to set, Cyclone takes from CYCLONEDDS_URI. Throws Error
  /// where the network cannot be had.
  explicit Participant(int domain);
  ~Participant();
  Participant(const Participant&) = delete;
  Participant& operator=(const Participant&) = delete;

  std::int32_t handle() const { return handle_; }

 private:
  std::int32_t handle_;
};

/// One topic, written to.
class TopicWriter {
 public:
  /// `topic`: its full name without the leading slash: "robot1/tf". `type`: one of message_types(), as all messages of
  /// the topic will be. Throws Error.
  TopicWriter(const Participant& participant, const std::string& topic, std::string_view type, const Qos& qos);
  ~TopicWriter();
  TopicWriter(const TopicWriter&) = delete;
  TopicWriter& operator=(const TopicWriter&) = delete;

  /// Sends a message. False where it could not be had off within 0.1 s: readers that acknowledge nothing hold up what
  /// is larger than Cyclone's buffers.
  bool send(const CdrWriter& message);
  /// Readers that get what is sent now.
  int readers() const;
  /// What readers have asked for that the topic does not offer: "reliability", …; empty where all match.
  std::string refused() const;
  /// Waits until readers have acknowledged all, where that matters; false after `most_ns`.
  bool wait_for_readers(std::int64_t most_ns) const;

 private:
  ddsi_sertype* type_;
  std::int32_t topic_ = 0, writer_ = 0;
};

}  // namespace berth::ros2
