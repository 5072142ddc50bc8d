#pragma once

#include <string>

#include "berth/detector.hpp"
#include "frame_json.hpp"
#include "frame_observer.hpp"

namespace berth::cli {

/// A frame as a recording keeps it, in one JSON object: where it came from, all that was found in it, and how long that
/// took. `config`: what it was searched with. `filtered`: MarkerFilters::to_json, or null.
Json frame_record(const ObservedFrame& frame, const DetectorConfig& config, const Json& filtered);

/// The first field in which two records of one frame differ to the last bit, with both values: "detections[0].pose.t[2]
/// is 0.5, was 0.25". Empty where they agree. What a frame took is not compared.
std::string first_difference(const Json& recorded, const Json& replayed);

}  // namespace berth::cli
