#pragma once

#include "berth/stations.hpp"
#include "table/sweeps.hpp"

namespace berth::table {

/// A camera on the plate, beside its marker, looks back at a marker beside the first camera; both markers have the side
/// of the stop's, both cameras the same lens. The robot's frame is its camera's, the dock's frame its marker's.
StationPair stations(const CameraModel& camera, double size_m);

/// The same stop as the plate's camera has it: where it sees the other marker.
Stop seen_back(const Stop& stop);

}  // namespace berth::table
