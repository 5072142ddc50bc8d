#include "moment_record.hpp"

namespace berth::cli {

const char* who_says(const FusedPose& fused) {
  return !fused.has_pose ? "none" : fused.used[0] && fused.used[1] ? "both" : fused.used[0] ? "robot" : "dock";
}

Json moment_record(const StationMoment& moment, const FusedPose& fused) {
  Json line;
  line["time_ns"] = fused.time_ns;
  line["by"] = who_says(fused);
  for (std::size_t side = 0; side < kStationSides; ++side) {
    if (!moment.came[side]) continue;
    const StationFrame& frame = moment.frames[side];
    line[name_of(static_cast<StationSide>(side))] = {
        {"sequence", frame.stamp.sequence}, {"mid_exposure_ns", frame.stamp.mid_exposure_ns}, {"sees", frame.sees}};
  }
  if (moment.came[0] && moment.came[1]) line["difference_ns"] = moment.difference_ns;
  if (fused.has_pose) {
    const RelativePose& robot = fused.robot;
    line["pose"] = {{"R", robot.pose.R},
                    {"t", robot.pose.t},
                    {"covariance", robot.uncertainty.covariance},
                    {"error_px", robot.uncertainty.error_px},
                    {"ambiguity", robot.uncertainty.ambiguity()}};
    if (robot.views == 2) {
      line["disagreement"] = robot.disagreement;
      line["apart"] = robot.difference;
    }
  }
  if (fused.disagree) line["disagree"] = true;
  return line;
}

}  // namespace berth::cli
