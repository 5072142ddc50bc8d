#pragma once

#include "berth/station_pairing.hpp"
#include "frame_json.hpp"

namespace berth::cli {

/// In recordings of `berth stations`: the metadata record with their settings, and the topic of the moments' records.
inline constexpr const char *kStationsMetadata = "berth.stations", *kMomentTopic = "/berth/moment";

/// Whom the pose is by: "both", "robot", "dock" or "none".
const char* who_says(const FusedPose& fused);

/// A moment as it is logged and recorded, in one JSON object (docs/stations.md).
Json moment_record(const StationMoment& moment, const FusedPose& fused);

}  // namespace berth::cli
