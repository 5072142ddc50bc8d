#include "moment_lines.hpp"

#include <fmt/format.h>

#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "frame_json.hpp"

namespace berth::cli {
namespace {

std::string text_of(const StationMoment& moment, const FusedPose& fused) {
  const std::string blind = moment.came[0] && moment.came[1] ? "blind" : "blind or without a frame";
  if (fused.used[0] && fused.used[1]) {
    return fmt::format("by both, disagreement {:.1f}{}", fused.robot.disagreement,
                       fused.disagree ? ": THEY DISAGREE" : "");
  }
  if (fused.disagree) return "no pose: THEY DISAGREE, no pose fits both";
  if (!fused.has_pose) return "no pose: both stations " + blind;
  return fused.used[0] ? "by the robot's camera alone, the dock's is " + blind
                       : "by the dock's camera alone, the robot's is " + blind;
}

std::string place_of(const FusedPose& fused) {
  if (!fused.has_pose) return "";
  const std::array<double, 3>& t = fused.robot.pose.t;
  const std::array<double, 36>& c = fused.robot.uncertainty.covariance;
  return fmt::format("robot at {:+.4f} {:+.4f} {:+.4f} m +- {:.2f} mm {:.2f} deg", t[0], t[1], t[2],
                     std::sqrt(c[0] + c[7] + c[14]) * 1e3,
                     std::sqrt(c[21] + c[28] + c[35]) * 180 / 3.14159265358979323846);
}

}  // namespace

MomentLines::MomentLines(std::ostream& people) : view_(people, false, std::nullopt) {}

void MomentLines::observe(const ObservedMoment& observed) {
  sum_.add(observed.moment, observed.fused);
  view_.show(sum_.moments, place_of(observed.fused), {}, text_of(observed.moment, observed.fused));
}

void MomentLines::finish(const BothCounts& counts, std::ostream& people) {
  people << fmt::format(
      "{} moment{}: {} by both, {} by the robot's camera alone, {} by the dock's alone, {} without a pose; the "
      "stations disagreed in {}\n",
      sum_.moments, sum_.moments == 1 ? "" : "s", sum_.by_both, sum_.by_robot, sum_.by_dock, sum_.without_pose(),
      sum_.disagreed);
  people << fmt::format("largest difference of paired mid-exposures {:.3f} ms\n", ms_of(sum_.largest_difference_ns));
  for (std::size_t side = 0; side < kStationSides; ++side) {
    const StationCounts& count = counts[side];
    people << fmt::format("{}: {} frames paired, {} alone", name_of(static_cast<StationSide>(side)), count.paired,
                          count.alone);
    if (count.out_of_order > 0) people << fmt::format(", {} kept out, out of order", count.out_of_order);
    if (count.dropped > 0) people << fmt::format(", {} dropped", count.dropped);
    people << '\n';
  }
}

}  // namespace berth::cli
