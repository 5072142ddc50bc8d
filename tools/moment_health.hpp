#pragma once

#include <string>

#include "moment_counts.hpp"
#include "moment_observer.hpp"
#include "ros2/messages.hpp"

namespace berth::cli {

/// Two stations' state for diagnostic_msgs: what moments came to since the last report, and since the start.
class MomentHealth {
 public:
  /// `gate`: of FusedPose::disagree.
  explicit MomentHealth(double gate) : gate_(gate) {}

  void add(const StationMoment& moment, const FusedPose& fused, const BothCounts& counts);
  /// The report of the time since the one before. Valid until the next.
  const ros2::DiagnosticStatus& report();

 private:
  double gate_;
  ros2::DiagnosticStatus status_;
  std::string message_;
  MomentCounts all_, new_;
  BothCounts counts_ = {};
  /// Of the last moment by both, and the largest since the last report.
  double disagreement_ = 0, largest_disagreement_ = 0;
};

}  // namespace berth::cli
