#include "table/second_station.hpp"

#include "sim/geometry.hpp"

namespace berth::table {
namespace {

// From each marker to the camera beside it.
constexpr double kBeside_m = 0.15;

// The one frame in the other: beside, and facing back.
Pose beside() { return {sim::rotation_y(sim::kPi), {kBeside_m, 0, 0}}; }

}  // namespace

StationPair stations(const CameraModel& camera, double size_m) {
  StationPair pair;
  for (Station* station : {&pair.robot, &pair.dock}) {
    station->lens = camera;
    station->marker_size_m = size_m;
  }
  pair.dock.camera = pair.dock.marker = beside();
  return pair;
}

Stop seen_back(const Stop& stop) {
  const Pose robot_in_dock = sim::inverse(stop.truth);
  Stop back = stop;
  back.truth = sim::compose(sim::inverse(beside()), sim::compose(robot_in_dock, beside()));
  return back;
}

}  // namespace berth::table
