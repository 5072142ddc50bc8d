#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "berth/frame.hpp"
#include "berth/health.hpp"
#include "berth/latency.hpp"
#include "ros2/messages.hpp"

namespace berth::cli {

/// A stream's state for diagnostic_msgs: what frames came to since the last report, and since the start.
class RosHealth {
 public:
  /// What else a report tells.
  struct Beside {
    /// Frames that found the queue full, and messages that could not be sent.
    std::uint64_t unpublished = 0, unsent = 0;
    /// Topics that readers ask more of than they offer: "pose (reliability)".
    std::string refused;
  };

  explicit RosHealth(std::string backend) : backend_(std::move(backend)) {}

  /// `latency_ns` below 0 where it is not known.
  void add(const FrameResult& result, const HealthReport& engine, std::int64_t latency_ns);
  /// The report of the time since the one before. Valid until the next.
  const ros2::DiagnosticArray& report(std::int64_t stamp_ns, double seconds, const Beside& beside);

 private:
  std::string backend_;
  ros2::DiagnosticArray array_;
  std::string message_;
  std::uint64_t frames_ = 0, with_pose_ = 0, missed_ = 0;
  std::uint64_t next_sequence_ = 0;
  /// Since the last report.
  std::uint64_t new_frames_ = 0, new_missed_ = 0, new_overflows_ = 0;
  HealthReport engine_;
  bool lost_device_ = false;
  LatencyHistogram latencies_;
};

}  // namespace berth::cli
