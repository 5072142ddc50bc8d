#include "moment_health.hpp"

#include <fmt/format.h>

#include <algorithm>

#include "frame_json.hpp"

namespace berth::cli {

void MomentHealth::add(const StationMoment& moment, const FusedPose& fused, const BothCounts& counts) {
  all_.add(moment, fused);
  new_.add(moment, fused);
  counts_ = counts;
  if (fused.robot.views < 2 || !fused.has_pose) return;
  disagreement_ = fused.robot.disagreement;
  largest_disagreement_ = std::max(largest_disagreement_, disagreement_);
}

const ros2::DiagnosticStatus& MomentHealth::report() {
  ros2::Level level = ros2::Level::ok;
  message_ = "both stations see each other";
  if (new_.moments == 0) {
    level = ros2::Level::stale;
    message_ = "no frame of either station";
  } else if (new_.disagreed > 0) {
    // One moment of ten thousand may do so by chance.
    level = 2 * new_.disagreed > new_.moments ? ros2::Level::error : ros2::Level::warn;
    message_ = fmt::format("the stations disagree in {} of {} moments", new_.disagreed, new_.moments);
  } else if (new_.by_both < new_.moments) {
    level = ros2::Level::warn;
    message_ =
        fmt::format("{} of {} moments by both, {} by the robot's camera alone, {} by the dock's, {} without a pose",
                    new_.by_both, new_.moments, new_.by_robot, new_.by_dock, new_.without_pose());
  }
  status_.level = level;
  status_.name = "berth: stations";
  status_.message = message_;
  status_.values = {{"moments", fmt::to_string(all_.moments)},
                    {"by_both", fmt::to_string(all_.by_both)},
                    {"by_robot", fmt::to_string(all_.by_robot)},
                    {"by_dock", fmt::to_string(all_.by_dock)},
                    {"without_pose", fmt::to_string(all_.without_pose())},
                    {"disagreed", fmt::to_string(all_.disagreed)},
                    {"disagreement", fmt::format("{:.3f}", disagreement_)},
                    {"largest_disagreement", fmt::format("{:.3f}", largest_disagreement_)},
                    {"gate", fmt::format("{}", gate_)},
                    {"largest_difference_ms", fmt::format("{:.3f}", ms_of(all_.largest_difference_ns))}};
  constexpr std::array<std::array<const char*, 4>, kStationSides> kKeys = {
      {{"robot_paired", "robot_alone", "robot_out_of_order", "robot_dropped"},
       {"dock_paired", "dock_alone", "dock_out_of_order", "dock_dropped"}}};
  for (std::size_t side = 0; side < kStationSides; ++side) {
    const StationCounts& count = counts_[side];
    status_.values.push_back({kKeys[side][0], fmt::to_string(count.paired)});
    status_.values.push_back({kKeys[side][1], fmt::to_string(count.alone)});
    status_.values.push_back({kKeys[side][2], fmt::to_string(count.out_of_order)});
    status_.values.push_back({kKeys[side][3], fmt::to_string(count.dropped)});
  }
  new_ = {};
  largest_disagreement_ = 0;
  return status_;
}

}  // namespace berth::cli
