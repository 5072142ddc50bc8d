#include "ros_health.hpp"

#include <fmt/format.h>

#include <algorithm>

namespace berth::cli {
namespace {

bool has_pose(const FrameResult& result) {
  const auto posed = [](const auto& thing) { return thing.has_pose; };
  return std::any_of(result.detections.begin(), result.detections.end(), posed) ||
         std::any_of(result.bundles.begin(), result.bundles.end(), posed) ||
         std::any_of(result.disc_targets.begin(), result.disc_targets.end(), posed);
}

}  // namespace

void RosHealth::add(const FrameResult& result, const HealthReport& engine, std::int64_t latency_ns) {
  // Numbers that were passed over belong to frames that were dropped on the way.
  const std::uint64_t sequence = result.stamp.sequence;
  if (frames_ > 0 && sequence > next_sequence_) {
    missed_ += sequence - next_sequence_;
    new_missed_ += sequence - next_sequence_;
  }
  next_sequence_ = sequence + 1;
  ++frames_;
  ++new_frames_;
  with_pose_ += has_pose(result) ? 1 : 0;
  new_overflows_ += result.status == FrameStatus::overflow ? 1 : 0;
  engine_ = engine;
  lost_device_ = result.status == FrameStatus::device_lost;
  if (latency_ns >= 0) latencies_.add(latency_ns);
}

const ros2::DiagnosticArray& RosHealth::report(std::int64_t stamp_ns, double seconds, const Beside& beside) {
  ros2::Level level = ros2::Level::ok;
  HealthMode mode = engine_.mode;
  message_ = text_of(mode);
  if (lost_device_) {
    level = ros2::Level::error;
    mode = HealthMode::failed;
    message_ = engine_.wrong_answers + engine_.alterations > 0 ? fmt::format("{}: {}", text_of(mode), engine_.reason)
                                                               : "the device was lost";
  } else if (new_frames_ == 0) {
    level = ros2::Level::stale;
    mode = HealthMode::stale;
    message_ = fmt::format("no frame for {:.1f} s", seconds);
  } else if (mode == HealthMode::fallback) {
    level = ros2::Level::warn;
    message_ = fmt::format("{}: {}", text_of(mode), engine_.reason);
  } else if (new_overflows_ > 0) {
    level = ros2::Level::warn;
    mode = HealthMode::overflow;
    message_ = fmt::format("{} frames held more than there is room for", new_overflows_);
  } else if (new_missed_ > 0) {
    level = ros2::Level::warn;
    message_ = fmt::format("{} frames dropped", new_missed_);
  } else if (!beside.refused.empty()) {
    level = ros2::Level::warn;
    message_ = "readers ask for what is not offered: " + beside.refused;
  }
  array_.header.stamp_ns = stamp_ns;
  array_.status.resize(1);
  ros2::DiagnosticStatus& status = array_.status[0];
  status.level = level;
  status.name = "berth: frames";
  status.message = message_;
  status.hardware_id = backend_;
  const double rate = seconds > 0 ? static_cast<double>(new_frames_) / seconds : 0;
  const auto ms = [&](double share) {
    return fmt::format("{:.3f}", static_cast<double>(latencies_.quantile(share)) / 1e6);
  };
  status.values = {{"frames", fmt::to_string(frames_)},
                   {"frames_with_pose", fmt::to_string(with_pose_)},
                   {"frames_per_second", fmt::format("{:.1f}", rate)},
                   {"frames_dropped", fmt::to_string(missed_)},
                   {"frames_not_published", fmt::to_string(beside.unpublished)},
                   {"messages_not_sent", fmt::to_string(beside.unsent)},
                   {"mode", name_of(mode)},
                   {"valid", mode < HealthMode::stale ? "true" : "false"},
                   {"known_answers", fmt::to_string(engine_.known_answers)},
                   {"wrong_answers", fmt::to_string(engine_.wrong_answers)},
                   {"memory_alterations", fmt::to_string(engine_.alterations)},
                   {"backend_tries", fmt::to_string(engine_.tries)},
                   {"backend_returns", fmt::to_string(engine_.returns)},
                   {"recovery", engine_.recovery}};
  if (latencies_.count() > 0) {
    status.values.push_back({"latency_p50_ms", ms(0.5)});
    status.values.push_back({"latency_p99_ms", ms(0.99)});
  }
  new_frames_ = new_missed_ = new_overflows_ = 0;
  latencies_.clear();
  return array_;
}

}  // namespace berth::cli
